"""What an engine runs: gateware with its clock, its inputs and its outputs by name."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from amaranth import Elaboratable, Signal

__all__ = ["Design", "Entity"]


@dataclass(frozen=True)
class Entity:
    """A description of a design in VHDL, written beside the gateware and not made of it.

    Its ports have the names and the widths of the design's; those of one bit are `std_logic`, the
    others `std_logic_vector`, downwards to 0.

    Attributes
    ----------
    name : str
        Name of the entity.
    files : tuple of path
        What it is made of, in the order in which it is analysed.
    generics : mapping of str to int or bool
        Values of its generics.
    renamed : mapping of str to str
        Names of its ports where the design's is a word of the language.
    """

    name: str
    files: tuple[Path, ...]
    generics: Mapping[str, int | bool] = field(default_factory=dict)
    renamed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Design:
    """Gateware ready to run.

    The gateware makes its own clock domains out of `clk`, so that what runs here is what is built.

    Attributes
    ----------
    name : str
        Name of the top module.
    top : Elaboratable
        The gateware. It is elaborated once; make a new design for a second engine.
    clk : Signal
        The one clock.
    inputs : mapping of str to Signal
        Inputs but the clock. Each is 0 until it is set.
    outputs : mapping of str to Signal
        Outputs.
    vhdl : Entity, optional
        The same in VHDL, for the engine that runs that.
    names : mapping of str to str
        On a board the bits of its machine: the output, input or register that has each.
    """

    name: str
    top: Elaboratable
    clk: Signal
    inputs: Mapping[str, Signal]
    outputs: Mapping[str, Signal]
    vhdl: Entity | None = None
    names: Mapping[str, str] = field(default_factory=dict)
