"""Shortening a stimulus that shows a difference, by delta debugging.

A stimulus is split into holds, each with the levels of all pins and a number of clocks, so that any
of them can be left out. The rest must still show a difference from power-up, though not necessarily
in the same clock.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .cosim import Finding
from .stimulus import Stimulus, cut

__all__ = ["Change", "Shrunk", "script", "shrink"]

Test: TypeAlias = Callable[[Stimulus], Finding | None]
HeldLevels: TypeAlias = tuple[tuple[int, ...], int]
"""Levels of all pins, and the number of clocks that they are held."""


@dataclass(frozen=True)
class Change:
    """Set the pins that change, for a number of clocks."""

    pins: tuple[tuple[str, int], ...]
    clocks: int = 1


@dataclass(frozen=True)
class Shrunk:
    """The shortest stimulus found that shows the difference.

    Attributes
    ----------
    stimulus : mapping of str to array
        Ends in the clock of the difference.
    finding : Finding
        The difference.
    runs : int
        Number of runs.
    """

    stimulus: Stimulus
    finding: Finding
    runs: int


def script(stimulus: Stimulus) -> list[Change]:
    """Return a stimulus as actions, each with the pins that change. All pins are 0 before."""
    names, before, actions = list(stimulus), (0,) * len(stimulus), []
    for levels, clocks in _holds(stimulus):
        changed = tuple((name, now) for name, old, now in zip(names, before, levels, strict=True)
                        if now != old)
        actions.append(Change(changed, clocks))
        before = levels
    return actions


def shrink(stimulus: Stimulus, test: Test, *, seconds: float = 60.0) -> Shrunk | None:
    """Shorten a stimulus to what its difference needs.

    Parameters
    ----------
    stimulus : mapping of str to array
        Ends in the clock of the difference.
    test : callable
        Runs a stimulus on engines at power-up; returns their difference.
    seconds : float
        Time limit, after which the best result so far is returned.

    Returns
    -------
    Shrunk or None
        None if the stimulus shows no difference at power-up.
    """
    return _Search(list(stimulus), test, time.monotonic() + seconds).search(stimulus)


def _holds(stimulus: Stimulus) -> list[HeldLevels]:
    table = np.stack([np.asarray(row).astype(np.int64) for row in stimulus.values()], axis=1)
    starts = np.flatnonzero(np.r_[True, (table[1:] != table[:-1]).any(axis=1)])
    clocks = np.diff(np.r_[starts, len(table)])
    return [(tuple(levels), int(n))
            for levels, n in zip(table[starts].tolist(), clocks, strict=True)]


class _Search:
    def __init__(self, names: Sequence[str], test: Test, deadline: float) -> None:
        self._names, self._test, self._deadline = names, test, deadline
        self._runs = 0
        self._best: tuple[list[HeldLevels], Finding] | None = None

    def search(self, stimulus: Stimulus) -> Shrunk | None:
        rows = len(next(iter(stimulus.values())))
        window = min(64, rows)
        # Most differences need only the last clocks.
        while not self._shows(_holds(cut(stimulus, rows - window, rows))):
            if window == rows:
                return None
            window = min(8 * window, rows)
        size = None
        while self._best and size != (size := self._size()) and not self._timed_out():
            self._leave_out()
            self._simplify()
            self._shorten()
        assert self._best is not None
        holds, finding = self._best
        return Shrunk(self._stimulus(holds), finding, self._runs)

    def _size(self) -> tuple[int, int, int]:
        holds = self._best[0] if self._best else []
        high = sum(level for levels, _ in holds for level in levels)
        return len(holds), sum(clocks for _, clocks in holds), high

    def _timed_out(self) -> bool:
        return time.monotonic() > self._deadline

    def _stimulus(self, holds: Sequence[HeldLevels]) -> dict[str, NDArray]:
        table = np.repeat(np.array([levels for levels, _ in holds]), [n for _, n in holds], axis=0)
        return {name: table[:, n] for n, name in enumerate(self._names)}

    def _shows(self, holds: Sequence[HeldLevels]) -> bool:
        """Run holds; if they show the difference accept them, up to its clock."""
        if not holds:
            return False
        stimulus = self._stimulus(holds)
        finding = self._test(stimulus)
        self._runs += 1
        if finding is None:
            return False
        self._best = _holds(cut(stimulus, 0, finding.difference.clock + 1)), finding
        return True

    def _current_holds(self) -> list[HeldLevels]:
        assert self._best is not None
        return self._best[0]

    def _leave_out(self) -> None:
        share = max(1, len(self._current_holds()) // 2)
        while not self._timed_out():
            place = 0
            while place < len(holds := self._current_holds()) and not self._timed_out():
                if not self._shows(holds[:place] + holds[place + share:]):
                    place += share
            if share == 1:
                break
            share = min(share // 2, max(1, len(self._current_holds()) // 2))

    def _simplify(self) -> None:
        """Try pins at 0 everywhere, or in single holds; or at least at 1."""
        for pin in range(len(self._names)):
            if self._timed_out():
                return
            if not any(levels[pin] for levels, _ in self._current_holds()):
                continue
            if self._shows([(_with(levels, pin, 0), n) for levels, n in self._current_holds()]):
                continue
            place = 0
            while place < len(self._current_holds()) and not self._timed_out():
                for level in (0, 1):
                    holds = self._current_holds()
                    if place < len(holds) and holds[place][0][pin] > level:
                        changed = (_with(holds[place][0], pin, level), holds[place][1])
                        self._shows([*holds[:place], changed, *holds[place + 1:]])
                place += 1

    def _shorten(self) -> None:
        place = 0
        while place < len(self._current_holds()):
            low = 0  # the longest known not to show it
            while (place < len(holds := self._current_holds()) and not self._timed_out()
                   and low + 1 < (clocks := holds[place][1])):
                tried = 1 if low == 0 else (low + clocks) // 2
                if not self._shows([*holds[:place], (holds[place][0], tried), *holds[place + 1:]]):
                    low = tried
            place += 1


def _with(levels: tuple[int, ...], pin: int, level: int) -> tuple[int, ...]:
    return (*levels[:pin], level, *levels[pin + 1:])
