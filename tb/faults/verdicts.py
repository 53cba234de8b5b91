"""What an injected fault comes to."""

from dataclasses import dataclass
from enum import IntEnum

__all__ = ["Register", "Silent", "Verdict", "WrongReset"]


class Verdict(IntEnum):
    """What an upset comes to.

    HARMLESS
        The motors end where they would have without it, and the machine counts so.
    VISIBLE
        A fault is shown, outside a reset, in a clock of the work in which it would not be, or for
        ever where the machine should be idle; or a machine on a line has answered otherwise.
    STUCK
        The machine stands still and is never idle again; but it knows where it is.
    SILENT
        None of these: with no sign of it the motors end somewhere else, or the machine believes so.
    """

    HARMLESS = 0
    VISIBLE = 1
    STUCK = 2
    SILENT = 3


@dataclass(frozen=True)
class Register:
    """A register by its path, and its bits."""

    name: str
    width: int


@dataclass(frozen=True)
class Silent:
    """A silent upset: which bit, in which clock of the work, and where the motors are for it.

    `place` is that of each motor from power-up, and `expected` where it would be without the upset.
    """

    register: str
    bit: int
    clock: int
    place: tuple[int, ...]
    expected: tuple[int, ...]


@dataclass(frozen=True)
class WrongReset:
    """What was found wrong with a reset, and in which clock."""

    clock: int
    what: str
