"""Model of the strings of a hanging plotter: from ticks of the place to each half step of a motor.

Written from what a string is: of which length, in whole steps, is nearest to the true one is said
by squares of whole numbers, anew at each tick. A tick is an eighth of a step.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isqrt

__all__ = ["TICKS", "MotorModel", "PlotterModel", "StringModel", "nearest_length"]

TICKS = 8
"""Ticks of a step."""

Steps = list[tuple[int, int]]
"""Clocks of steps, and 1 for those forward, -1 for those back."""


def nearest_length(across: int, below: int) -> int:
    """Return the length of a string in steps, of a point in ticks; of two equally near the less."""
    square = across**2 + below**2
    length = isqrt(square) // TICKS
    return length + (4 * square > TICKS**2 * (2 * length + 1) ** 2)


@dataclass
class StringModel:
    """A string, clock by clock: a clock for a step of its length, else for a tick that waits."""

    place: list[int]
    waits: list[int] = field(default_factory=lambda: [0, 0])

    def __post_init__(self) -> None:
        self.length = nearest_length(*self.place)

    @property
    def _wrong(self) -> int:
        """1 or -1 where the length is to become more, or less."""
        right = nearest_length(*self.place)
        return (right > self.length) - (right < self.length)

    @property
    def busy(self) -> bool:
        """Whether it has a tick or a step to make."""
        return bool(any(self.waits) or self._wrong)

    def edge(self, ticks: Sequence[int]) -> None:
        """Go to the next clock, with ticks across and below: 1 away from the pulley, -1 back."""
        if wrong := self._wrong:
            self.length += wrong
        else:
            for way, wait in enumerate(self.waits):
                if wait:
                    self.place[way] += wait
                    self.waits[way] = 0
                    break
        self.waits = [tick or wait for tick, wait in zip(ticks, self.waits, strict=True)]


@dataclass
class MotorModel:
    """A motor with power that makes its string as long as it shall be, each step after a period."""

    made: int
    period: int
    free: int = 0

    def edge(self, clock: int, length: int) -> int:
        """Go to the next clock; return the step that is made: 1, -1, or 0."""
        if length == self.made or clock < self.free:
            return 0
        step = 1 if length > self.made else -1
        self.made += step
        self.free = clock + self.period
        return step


class PlotterModel:
    """A point on two strings, from steps of its coordinates to those of the motors.

    Parameters
    ----------
    width : int
        From pulley to pulley in ticks.
    place : tuple of int
        Where it hangs at first, in ticks from the left pulley, y down.
    period : int
        Least clocks between two steps of a motor.
    """

    def __init__(self, *, width: int, place: tuple[int, int], period: int) -> None:
        across, below = place
        self.strings = StringModel([across, below]), StringModel([width - across, below])
        self.motors = [MotorModel(each.length, period) for each in self.strings]
        self._pending = [0, 0]

    def steps(self, right: Steps, up: Steps, after: int = 100) -> list[Steps]:
        """Return the steps of both motors, of ticks to the right and up, in their clocks.

        Parameters
        ----------
        right, up : list of tuple
            Clocks of ticks, and 1 for those to the right, or up.
        after : int
            Clocks behind the last tick in which motors are looked at, if they have nothing to do.
        """
        ticks = [dict(right), dict(up)]
        found: list[Steps] = [[], []]
        clock = min([min(each, default=1 << 62) for each in ticks])
        end = max([max(each, default=0) for each in ticks]) + after
        while clock <= end or any(motor.made != string.length for motor, string in zip(
                self.motors, self.strings, strict=True)):
            works = any(string.busy for string in self.strings)
            lengths = [string.length for string in self.strings]
            taken = [0 if works else (each > 0) - (each < 0) for each in self._pending]
            self.strings[0].edge((taken[0], -taken[1]))
            self.strings[1].edge((-taken[0], -taken[1]))
            for way, tick in enumerate(taken):
                self._pending[way] += ticks[way].get(clock, 0) - tick
            for made, motor, length in zip(found, self.motors, lengths, strict=True):
                if step := motor.edge(clock, length):
                    made.append((clock, step))
            clock += 1
        return found
