"""A design that engines run: gateware with its clock, inputs and outputs by name."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from amaranth import Elaboratable, Signal

__all__ = ["Design", "Entity"]


@dataclass(frozen=True)
class Entity:
    """A VHDL reference of a design, written independently of the gateware.

    Its ports have the names and the widths of the design's; those of one bit are `std_logic`, the
    others `std_logic_vector`, downwards to 0.

    Attributes
    ----------
    name : str
        Name of the entity.
    files : tuple of path
        Its files, in the order of analysis.
    generics : mapping of str to int or bool
        Values of its generics.
    renamed : mapping of str to str
        Names of its ports where the design's is a reserved word.
    """

    name: str
    files: tuple[Path, ...]
    generics: Mapping[str, int | bool] = field(default_factory=dict)
    renamed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Design:
    """Gateware ready to run.

    The gateware derives its clock domains from `clk`, as it does on a board.

    Attributes
    ----------
    name : str
        Name of the top module.
    top : Elaboratable
        The gateware. It is elaborated once; a second engine needs a new design.
    clk : Signal
        The clock.
    inputs : mapping of str to Signal
        Inputs without the clock. Each is 0 until it is set.
    outputs : mapping of str to Signal
        Outputs.
    vhdl : Entity, optional
        The VHDL reference, for GHDL.
    names : mapping of str to str
        On a board: the output, input or register of the design for each bit of the machine.
    """

    name: str
    top: Elaboratable
    clk: Signal
    inputs: Mapping[str, Signal]
    outputs: Mapping[str, Signal]
    vhdl: Entity | None = None
    names: Mapping[str, str] = field(default_factory=dict)
