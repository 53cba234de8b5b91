"""Where a motor may go and when: its steps, counted at the pins, against what was asked of it.

All places are in steps from power-up, as the pins count them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["NEVER", "Effect", "Failure", "Mode", "Steps", "TrajectoryCheck", "check_trajectory",
           "intervals", "lateness"]

NEVER = 1 << 60
"""A clock that is not reached."""


class Failure(NamedTuple):
    """Something that must not be.

    Attributes
    ----------
    clock : int
        From when on it is seen.
    kind : str
        ``step``, ``time``, ``place``, ``answer`` or ``pins``.
    message : str
        What it is.
    """

    clock: int
    kind: str
    message: str


class Mode(NamedTuple):
    """What a motor was asked to do.

    Attributes
    ----------
    low, high : int
        Where it goes: to one place, if both are the same, or one between them.
    rate : int
        Its steps in as many clocks as the modulus.
    run : bool
        It goes; else it makes no step.
    """

    low: int
    high: int
    rate: int
    run: bool


class Effect(NamedTuple):
    """A mode begins: in a clock from `earliest` to `latest`."""

    earliest: int
    latest: int
    mode: Mode


@dataclass(frozen=True)
class Steps:
    """Steps of a motor.

    Attributes
    ----------
    clock : array of int64
        When each is seen at the pins. Ascending.
    direction : array of int64
        Its direction, 1 or -1.
    place : array of int64
        Where what it moves is before each, and at last.
    """

    clock: NDArray[np.int64]
    direction: NDArray[np.int64]
    place: NDArray[np.int64]

    @classmethod
    def of(cls, clock: NDArray, direction: NDArray, moves: NDArray | None = None) -> "Steps":
        """Count steps; `moves` is what each moves, 1, 0 or -1, its direction by default."""
        direction = direction.astype(np.int64)
        return cls(clock.astype(np.int64), direction,
                   np.concatenate([[0], np.cumsum(direction if moves is None else moves)]))

    def between(self, first: int, last: int) -> tuple[int, int]:
        """Return the lowest and the highest place from one clock to another."""
        begin, end = np.searchsorted(self.clock, [first, last], "right")
        places = self.place[begin:end + 1]
        return int(places.min()), int(places.max())


class TrajectoryCheck(NamedTuple):
    """What came of it.

    Attributes
    ----------
    failures : list of Failure
        What must not be.
    timed : int
        Steps that have a time at which they must come.
    deviation : float
        The farthest of them from it, in clocks, see `lateness`.
    """

    failures: list[Failure]
    timed: int
    deviation: float


def lateness(clocks: NDArray[np.int64], first: NDArray[np.int64], modulus: int,
             rate: NDArray[np.int64] | int) -> NDArray[np.int64]:
    """Return how late steps are, in clocks times `rate`, each against the `first` of its like.

    Those of one rate, as late as each other but for rounding, are less than a clock apart.
    """
    order = np.arange(len(clocks))
    return (clocks - clocks[first]) * rate - (order - first) * modulus


def check_trajectory(steps: Steps, effects: Sequence[Effect], modulus: int, clocks: int,
                     slack: int) -> TrajectoryCheck:
    """Look at all steps of a motor.

    Parameters
    ----------
    steps : Steps
        What it did.
    effects : sequence of Effect
        What it was asked to do, in order; the first is what it does at power-up.
    modulus : int
        See `Mode`.
    clocks : int
        How long it was looked at.
    slack : int
        Clocks that a step may take besides its time, where a motor turns round, for example.
    """
    bounds, spans = intervals(effects, clocks)
    begins, ends = bounds[:-1], bounds[1:]
    sure = np.array([len(span) == 1 and span[0].run and
                     span[0].low == span[0].high for span in spans])
    highest = np.array([max((mode.high for mode in span if mode.run), default=-2**62)
                        for span in spans])
    lowest = np.array([min((mode.low for mode in span if mode.run), default=2**62)
                       for span in spans])
    rate = np.array([span[0].rate for span in spans])

    of = np.searchsorted(begins, steps.clock, "right") - 1
    before = steps.place[:-1]
    astray = np.where(steps.direction > 0, before >= highest[of], before <= lowest[of])
    failures = [Failure(int(steps.clock[n]), "step",
                        f"a step {'up' if steps.direction[n] > 0 else 'down'} from {before[n]} "
                        f"that no "
                        "command requested")
                for n in np.flatnonzero(astray)[:1]]

    # Steps that must be there
    begin = np.searchsorted(steps.clock, begins, "left")
    made = np.searchsorted(steps.clock, ends, "left") - begin
    due = np.maximum(0, (ends - begins - slack) * rate // modulus - 1)
    left = np.abs(highest - steps.place[begin])
    for n in np.flatnonzero(sure & (made < np.minimum(due, left)))[:1]:
        failures.append(Failure(
            int(begins[n]), "step", f"{made[n]} steps where {min(due[n], left[n])} were requested "
            f"by clock {ends[n]}"))

    # Steps that must come at their time, as late as the first
    timed = sure[of]
    if not timed.any():
        return TrajectoryCheck(failures, 0, 0.0)
    clock, at = steps.clock[timed], of[timed]
    first = np.searchsorted(at, at, "left")
    late = lateness(clock, first, modulus, rate[at])
    heads = np.flatnonzero(np.r_[True, at[1:] != at[:-1]])
    apart = (np.maximum.reduceat(late, heads) - np.minimum.reduceat(late, heads)) / rate[at[heads]]
    for n in np.flatnonzero(apart >= 1)[:1]:
        failures.append(Failure(
            int(clock[heads[n]]), "time", "steps are not at their times: one is "
            f"{apart[n]:.3f} clocks later than another"))
    return TrajectoryCheck(failures, len(clock), float(apart.max()))


def intervals(effects: Sequence[Effect], clocks: int) -> tuple[NDArray[np.int64], list[list[Mode]]]:
    """Return the clocks at which what is requested changes, and what it may be from each on.

    The last is `clocks`, when one stops looking.
    """
    latest = effects[0].latest
    starts, ends = [effects[0].earliest], []
    for effect in effects[1:]:  # in order, so none begins before the one before it
        starts.append(max(starts[-1], effect.earliest))
    for effect in effects:
        latest = max(latest, effect.latest)
        ends.append(latest)
    bounds = sorted({-1, clocks, *(clock for clock in (*starts, *ends) if -1 < clock < clocks)})
    spans, first, last = [], 0, 0
    for begin in bounds[:-1]:
        while last + 1 < len(effects) and starts[last + 1] <= begin:
            last += 1
        while first < last and ends[first + 1] <= begin:
            first += 1
        spans.append([effect.mode for effect in effects[first:last + 1]])
    return np.array(bounds, np.int64), spans
