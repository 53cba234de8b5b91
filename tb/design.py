"""What an engine runs: gateware with its clock, its inputs and its outputs by name."""

from collections.abc import Mapping
from dataclasses import dataclass

from amaranth import Elaboratable, Signal

__all__ = ["Design"]


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
    """

    name: str
    top: Elaboratable
    clk: Signal
    inputs: Mapping[str, Signal]
    outputs: Mapping[str, Signal]
