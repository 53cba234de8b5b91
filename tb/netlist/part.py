"""What of a machine is checked as a netlist."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from .subject import Subject
from .unknown import Runnable

__all__ = ["BuiltPins", "NetlistPart"]


@dataclass(frozen=True)
class BuiltPins:
    """Verilog as a tool flow is given it, with the pins of a board.

    Attributes
    ----------
    name, top : str
        What people call it, and its module.
    verilog : callable
        Makes the Verilog.
    clock : str
        The pin of the clock.
    """

    name: str
    top: str
    verilog: Callable[[], str]
    clock: str


@dataclass(frozen=True)
class NetlistPart:
    """What of a machine is checked as a netlist.

    Attributes
    ----------
    equal, codes, pins : sequence of Subject
        What is compared with its RTL; where unused codes must be left; whose input pins must be
        synchronised.
    built : sequence of BuiltPins
        Further designs whose pins are checked.
    unknown : sequence of Runnable
        Where no output may be X.
    flipped : sequence of (Subject, int or None)
        Where bits of look-up tables are flipped, and how many at most; None for as many as asked.
    mistakes : mapping of str to sequence of (Subject, str)
        Subjects with a mistake that ``codes`` or ``pins`` must find, and what it is.
    leaves_out : mapping of str to mapping of str to str
        For checks by name: designs that they cannot look at, and why.
    """

    equal: Sequence[Subject] = ()
    codes: Sequence[Subject] = ()
    pins: Sequence[Subject] = ()
    built: Sequence[BuiltPins] = ()
    unknown: Sequence[Runnable] = ()
    flipped: Sequence[tuple[Subject, int | None]] = ()
    mistakes: Mapping[str, Sequence[tuple[Subject, str]]] = field(default_factory=dict)
    leaves_out: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
