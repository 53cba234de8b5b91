"""The order of lines: merged, each in the direction that suits, with little travel between them.

Nothing here changes what is on the wall by more than the tolerance: lines that are there twice are
drawn once, lines that touch are drawn as one, and any may be drawn from its other end.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .curves import Polyline

__all__ = ["Ordered", "Silent", "deduplicated", "merged", "nearest", "ordered",
           "simplified", "travel", "turned", "two_opt", "vpype_missing"]

PAIRS_A_SECOND = 20_000_000
"""That two-opt looks at, or more: what it does is bounded by their number, not by a clock, so that
a drawing has the same order on every machine."""

LEAST_GAIN = 1e-9
"""In mm: less is rounding."""


class Ordered(NamedTuple):
    """Lines in their order, and what that has saved.

    Attributes
    ----------
    lines : list of array of complex
        As they are drawn.
    before, after : float
        Travel with the pen up in the order of the file, and in this one, in mm.
    twice : int
        Lines that were left out since they are there twice.
    by : str
        What has sorted them.
    """

    lines: list[Polyline]
    before: float
    after: float
    twice: int
    by: str


class Silent:
    """Shows nothing: what `console.Progress` is where a terminal looks on."""

    def __init__(self, total: int, unit: str, label: str) -> None:
        pass

    def __enter__(self) -> "Silent":
        return self

    def __exit__(self, *exception) -> None:
        pass

    def advance(self, amount: int = 1) -> None:
        """Take no notice."""


def ordered(lines: Sequence[Polyline], tolerance: float, rest: complex, *, effort: float = 10.0,
            vpype: bool | None = None, progress: Callable[[int, str, str], Any] = Silent
            ) -> Ordered:
    """Merge, simplify and sort lines, from a place of rest back to it.

    Parameters
    ----------
    lines : sequence of array of complex
        Places in mm.
    tolerance : float
        How far a line may be from where it was, in mm, and ends that are joined from each other.
    rest : complex
        Where the pen is before and after.
    effort : float
        About how many seconds two-opt may take.
    vpype : bool, optional
        Whether vpype merges and sorts, before two-opt. If it is installed, if not given.
    progress : class
        Shows how each step goes on: `console.Progress`, say.
    """
    uses_vpype = vpype_missing() is None if vpype is None else vpype
    before = travel(lines, rest)
    once = deduplicated(lines)
    if uses_vpype:
        from .by_vpype import merge_and_sort

        with progress(1, "pens", "merging and sorting by vpype"):
            found = merge_and_sort(once, tolerance)
    else:
        with progress(1, "pens", "merging"):
            joined = [simplified(line, tolerance) for line in merged(once, tolerance)]
        with progress(len(joined), "lines", "sorting") as shown:
            found = nearest(joined, rest, shown.advance)
    if travel(found, rest) > travel(once, rest):
        found = once
    pairs = round(effort * PAIRS_A_SECOND)
    with progress(pairs, "pairs at most", "shortening the travel") as shown:
        found = turned(two_opt(found, rest, pairs, shown.advance), rest)
    return Ordered(found, before, travel(found, rest), len(lines) - len(once),
                   "vpype and two-opt" if uses_vpype else "nearest neighbour and two-opt")


def vpype_missing() -> str | None:
    """Return what to install for vpype, or None if it is there."""
    from importlib.util import find_spec

    there = find_spec("vpype") is not None and find_spec("vpype_cli") is not None
    return None if there else "vpype missing: pip install -e '.[vpype]'"


def travel(lines: Sequence[Polyline], rest: complex) -> float:
    """Return the way with the pen up: from rest to the first line, between all, and back."""
    if not lines:
        return 0.0
    ends = np.array([rest, *(line[-1] for line in lines)])
    starts = np.array([*(line[0] for line in lines), rest])
    return float(np.abs(starts - ends).sum())


def deduplicated(lines: Iterable[Polyline]) -> list[Polyline]:
    """Leave out lines that are there twice, from either end."""
    seen: set[bytes] = set()
    kept = []
    for line in lines:
        exact = np.round(line, 6) + 0.0  # no negative zeros
        keys = {exact.tobytes(), exact[::-1].tobytes()}
        if seen.isdisjoint(keys):
            kept.append(line)
        seen |= keys
    return kept


def simplified(line: Polyline, tolerance: float) -> Polyline:
    """Return a line with fewer points, none of the others farther from it than this.

    By Douglas and Peucker: the point that is farthest from the chord stays, unless it is near.
    """
    keep = np.zeros(len(line), bool)
    keep[[0, -1]] = True
    parts = [(0, len(line) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        inner, chord = line[first + 1:last] - line[first], line[last] - line[first]
        square = abs(chord) ** 2
        along = np.clip((inner * chord.conjugate()).real / square, 0, 1) if square else 0.0
        distance = np.abs(inner - along * chord)
        farthest = int(distance.argmax())
        if distance[farthest] > tolerance:
            middle = first + 1 + farthest
            keep[middle] = True
            parts += [(first, middle), (middle, last)]
    return line[keep]


class _Ends:
    """Ends of lines by their place, to find one within a distance."""

    def __init__(self, lines: Sequence[Polyline], distance: float) -> None:
        self._lines, self._distance = lines, distance
        self._cells: dict[tuple[int, int], dict[tuple[int, bool], complex]] = {}
        for number, line in enumerate(lines):
            for at_end, point in ((False, line[0]), (True, line[-1])):
                self._cells.setdefault(self._cell(point), {})[number, at_end] = complex(point)

    def _cell(self, point: complex) -> tuple[int, int]:
        side = max(self._distance, 1e-6)
        return int(point.real // side), int(point.imag // side)

    def take(self, number: int) -> None:
        """Forget the ends of a line."""
        for at_end, point in ((False, self._lines[number][0]), (True, self._lines[number][-1])):
            self._cells[self._cell(point)].pop((number, at_end), None)

    def near(self, point: complex) -> tuple[int, bool] | None:
        """Return the nearest end: of which line, and whether it is its last point."""
        x, y = self._cell(point)
        cells = itertools.product((x - 1, x, x + 1), (y - 1, y, y + 1))
        found = [(distance, key) for cell in cells
                 for key, place in self._cells.get(cell, {}).items()
                 if (distance := abs(place - point)) <= self._distance]
        return min(found)[1] if found else None


def merged(lines: Sequence[Polyline], distance: float) -> list[Polyline]:
    """Join lines whose ends are within a distance, in either direction."""
    ends = _Ends(lines, distance)
    taken = np.zeros(len(lines), bool)
    joined = []
    for number in range(len(lines)):
        if taken[number]:
            continue
        chain = [lines[number]]
        taken[number] = True
        ends.take(number)
        while (found := ends.near(complex(chain[-1][-1]))) is not None:
            other, at_end = found
            chain.append(lines[other][::-1] if at_end else lines[other])
            taken[other] = True
            ends.take(other)
        while (found := ends.near(complex(chain[0][0]))) is not None:
            other, at_end = found
            chain.insert(0, lines[other] if at_end else lines[other][::-1])
            taken[other] = True
            ends.take(other)
        joined.append(_joined(chain))
    return joined


def _joined(chain: Sequence[Polyline]) -> Polyline:
    points = np.concatenate(chain)
    same = np.concatenate([[False], points[1:] == points[:-1]])
    return points if len(chain) == 1 else points[~same]


def nearest(lines: Sequence[Polyline], start: complex,
            progress: Callable[[int], None] = lambda done: None) -> list[Polyline]:
    """Return lines so that after each the one with the nearest end is next, in either direction."""
    ends = np.array([[line[0] for line in lines], [line[-1] for line in lines]]).T.ravel()
    found, at = [], start
    for _ in lines:
        index = int(np.abs(ends - at).argmin())
        number, at_end = divmod(index, 2)
        line = lines[number][::-1] if at_end else lines[number]
        found.append(line)
        ends[2 * number:2 * number + 2] = np.inf
        at = complex(line[-1])
        progress(1)
    return found


def two_opt(lines: Sequence[Polyline], rest: complex, pairs: int,
            progress: Callable[[int], None] = lambda done: None) -> list[Polyline]:
    """Shorten the travel: reverse runs of lines as long as that helps.

    A run drawn backwards changes only how the pen comes to it and leaves it. For each first line
    the best last one is found in one go.

    Parameters
    ----------
    lines : sequence of array of complex
        In the order to begin with.
    rest : complex
        Where the pen is before and after.
    pairs : int
        How many pairs of first and last line are looked at, at most.
    progress : callable
        Called with those looked at since the last call.
    """
    count = len(lines)
    # Of each place in the order: the line, as a number or its complement if it is reversed.
    order = np.arange(count)
    starts = np.array([line[0] for line in lines], complex)
    ends = np.array([line[-1] for line in lines], complex)
    improved, left = count > 0, pairs
    while improved and left > 0:
        improved = False
        for first in range(count):
            if left <= 0:
                break
            before = ends[first - 1] if first else rest
            after = np.append(starts[first + 1:], rest)
            gain = (abs(before - starts[first]) + np.abs(ends[first:] - after)
                    - np.abs(before - ends[first:]) - np.abs(starts[first] - after))
            last = int(gain.argmax())
            left -= count - first
            progress(count - first)
            if gain[last] > LEAST_GAIN:
                improved = True
                run = slice(first, first + last + 1)
                order[run] = ~order[run][::-1]
                starts[run], ends[run] = ends[run][::-1].copy(), starts[run][::-1].copy()
    return [lines[each] if each >= 0 else lines[~each][::-1] for each in order.tolist()]


def turned(lines: Sequence[Polyline], rest: complex) -> list[Polyline]:
    """Begin each closed line at the point of it that the travel to it and from it is least with."""
    found, at = [], rest
    for number, line in enumerate(lines):
        after = lines[number + 1][0] if number + 1 < len(lines) else rest
        if len(line) > 2 and line[0] == line[-1]:
            best = int((np.abs(line[:-1] - at) + np.abs(line[:-1] - after)).argmin())
            line = np.append(np.roll(line[:-1], -best), line[best])
        found.append(line)
        at = complex(line[-1])
    return found
