"""The axes of `positioner`: what is known of each, and whether what begins and ends it may."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tb.fuzz.trajectory import Effect, Failure, Mode, Steps

from .lines import AXES, DOWN, START_SPEED, UP

__all__ = ["Axis", "Ends", "load_steps"]


def load_steps(seen: Mapping[str, NDArray], backlash: Sequence[int]
          ) -> tuple[list[Steps], list[Failure]]:
    """Count the steps of the motors at their pins, and where the loads are.

    Play is a gap: a motor that reverses moves nothing until it is through. At power-up it is where
    a movement down leaves it. Says where a motor has no power.
    """
    found, failures = [], []
    for axis in range(AXES):
        step = seen["step"] >> axis & 1
        clock = np.flatnonzero(~step[:-1] & step[1:]) + 1
        direction = np.where(seen["direction"][clock] >> axis & 1, 1, -1)
        moves = np.fromiter(_moves(direction, backlash[axis]), np.int64)
        found.append(Steps.of(clock, direction, moves))
        failures += [Failure(int(clock[n]), "pins", f"motor {axis + 1} steps without power")
                     for n in np.flatnonzero(seen["enable"][clock] >> axis & 1 == 0)[:1]]
    return found, failures


def _moves(directions: NDArray, backlash: int) -> Iterator[int]:
    """Yield what each step moves a load."""
    gap = 0  # steps up that move nothing less those that are left
    for direction in directions.tolist():
        through = gap + direction
        gap = min(max(through, 0), backlash)
        yield through - gap


class Ends:
    """The switches of an axis.

    Parameters
    ----------
    low, high : array of int
        The switch at that end is pressed, a level a clock.
    settle : int
        Clocks for which a switch counts as pressed; up to twice as many it may.
    """

    def __init__(self, low: NDArray, high: NDArray, settle: int) -> None:
        self._settle = settle
        self._sums = {direction: np.concatenate([[0], np.cumsum(pressed, dtype=np.int64)])
                      for direction, pressed in ((-1, low), (1, high))}

    def may_block(self, clock: int, directions: Sequence[int]) -> bool:
        """Return whether a switch may block a step in a clock, in one of some directions."""
        begin = max(0, clock + 1 - 2 * self._settle)
        return any(self._sums[direction][clock + 1] > self._sums[direction][begin]
                   for direction in directions)

    def passed(self, steps: Steps) -> list[Failure]:
        """Return where a step goes towards a switch that counts as pressed."""
        failures = []
        for direction, sums in self._sums.items():
            clock = steps.clock[steps.direction == direction]
            begin = np.maximum(0, clock - 1 - self._settle)
            failures += [Failure(int(at), "step", "a step towards a switch that is pressed")
                         for at in clock[sums[clock] > sums[begin]][:1]]
        return failures


@dataclass
class Axis:
    """What is known of an axis: `low` to `high` is what its place is called, less its steps.

    Parameters
    ----------
    name : str
        What it is called where something is wrong.
    steps : Steps
        What its motor did.
    ends : Ends
        Its switches.
    changes : sequence of int
        Clocks in which it begins to have a movement and ceases to, in turn.

    Attributes
    ----------
    effects : list of Effect
        What it was asked to do.
    blocked : list of int
        Clocks in which a switch has ended a movement.
    perhaps : list of int
        Clocks in which it may have.
    """

    name: str
    steps: Steps
    ends: Ends
    changes: Sequence[int]
    effects: list[Effect] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    blocked: list[int] = field(default_factory=list)
    perhaps: list[int] = field(default_factory=list)
    rate: int = START_SPEED
    goes: str = ""  # "", "C", "CC" or "GOTO"
    point: int = 0

    def __post_init__(self) -> None:
        self.low = self.high = self._next = 0
        self._before, self._loose_until = (0, 0), -1
        self._asked = -1, -1  # when the last command that begins or ends a movement is obeyed
        self.mode(-1, -1)

    # What commands do

    def mode(self, earliest: int, latest: int) -> None:
        """Begin what it is to do now, some time between two clocks."""
        self.effects.append(Effect(earliest, latest, Mode(
            self._target - self.high, self._target - self.low, self.rate, bool(self.goes))))

    def go(self, goes: str, earliest: int, latest: int) -> None:
        """Begin a movement, or end it."""
        self.goes, self._asked = goes, (earliest, latest)
        self.mode(earliest, latest)

    def call(self, place: int, earliest: int, latest: int) -> None:
        """Call where it is a place."""
        low, high = self.steps.between(earliest, latest)
        self._before = (self.low, self.high) if self._loose_until < earliest else (
            min(self._before[0], self.low), max(self._before[1], self.high))
        self.low, self.high, self._loose_until = place - high, place - low, latest
        if self.goes == "GOTO":
            self.goes, self._asked = "", (earliest, latest)
        self.mode(earliest, latest)

    @property
    def _target(self) -> int:
        return {"C": UP, "CC": DOWN}.get(self.goes, self.point)

    # What it does

    def report(self, clock: int, place: int) -> None:
        """Compare with what is reported of it."""
        least, most = self.steps.between(clock - 6, clock - 2)
        low, high = self._called(clock)
        if not least + low <= place <= most + high:
            self.failures.append(Failure(clock, "place", f"{self.name} is reported at {place}, "
                                         f"and is at {least + low} to {most + high}"))
        if clock > self._loose_until + 8:
            self.low, self.high = max(low, place - most), min(high, place - least)

    def until(self, clock: int) -> None:
        """Look at where it begins and ends to move, up to a clock."""
        while self._next < len(self.changes) and self.changes[self._next] <= clock:
            at = self.changes[self._next]
            self._next += 1
            (self._begins if self._next % 2 else self._ends)(at)
        if clock > self._asked[1] and bool(self.goes) != bool(self._next % 2):
            self._fail(clock, f"{'has no' if self.goes else 'still has a'} movement")

    def _fail(self, clock: int, message: str) -> None:
        self.failures.append(Failure(clock, "step", f"{self.name} {message}"))

    def _called(self, clock: int) -> tuple[int, int]:
        low, high = self.low, self.high
        if clock <= self._loose_until + 8:
            low, high = min(low, self._before[0]), max(high, self._before[1])
        return low, high

    def _begins(self, at: int) -> None:
        earliest, latest = self._asked
        if not self.goes or not earliest < at <= latest:
            self._fail(at, "begins to move, which no command requested")

    def _ends(self, at: int) -> None:
        """Find out why a movement ends: a command, or a switch, or it is where it goes."""
        earliest, latest = self._asked
        asked = earliest < at <= latest
        again = self._next < len(self.changes) and self.changes[self._next] <= latest
        # the movement before, so it is not known whither
        if asked and (again or not self.goes):
            if self.ends.may_block(at - 1, (-1, 1)):
                self.perhaps.append(at)
            return
        place, _ = self.steps.between(at - 1, at - 1)
        low, high = self._called(at)
        low, high = low + place, high + place
        directions = [*[1] * (low < self._target), *[-1] * (high > self._target)]
        blocked = self.ends.may_block(at - 1, directions)
        arrived = low <= self._target <= high
        if not self.goes or not (blocked or arrived):
            self._fail(at, f"ends to move at {low} to {high}, which nothing requested")
        elif blocked:
            (self.perhaps if arrived else self.blocked).append(at)
        self.goes = ""
        self.mode(at, at)
