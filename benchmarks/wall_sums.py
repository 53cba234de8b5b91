"""What is kept of lines that the hanging plotter draws: how far its pen and strings are off."""

import random
from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from fresa.machines.vplotter import VPlotterSettings

from .wall_path import PlannedLine, Point, Wall, followed

__all__ = ["BANDS", "CELL", "Motors", "Sums", "bowed", "follow", "measure", "random_line", "wall"]

BANDS = (50, 100, 200, 300, 500)
"""Least y in mm, of figures and of the wall on which lines are drawn."""

CELL = 20
"""Mm of a cell of the map."""

SAMPLES = 1000
"""Instants of a line at which speeds, and bowed lines, are looked at."""


def _none() -> NDArray[np.float64]:
    return np.zeros(len(BANDS))


def _add(total, other) -> None:
    """Add numbers that are whole; of others keep the highest."""
    for name in (each.name for each in fields(total) if each.name != "apart"):
        one, two = getattr(total, name), getattr(other, name)
        setattr(total, name, one + two if isinstance(one, int) else np.maximum(one, two))


@dataclass
class Sums:
    """What is kept of lines.

    Attributes
    ----------
    chart : array
        Farthest place of the pen from its line, in mm, in each cell of the wall.
    straight, bowed, acceleration : array
        By bands: farthest places from lines as they are drawn and as the thesis drew them, highest
        acceleration of a string in mm/s².
    error : float
        By how much a string was off at most, in steps.
    speed, share : float
        Highest speed of a string, of that of the path, and acceleration, of what is allowed there.
    apart : float
        Least clocks between two steps of a string that are requested in one direction.
    ticks, steps, turned, near : int
        Ticks of X and Y, steps of strings, those that take back the one before, and those that come
        within a period of it.
    """

    chart: NDArray[np.float64]
    straight: NDArray[np.float64] = field(default_factory=_none)
    bowed: NDArray[np.float64] = field(default_factory=_none)
    acceleration: NDArray[np.float64] = field(default_factory=_none)
    error: float = 0.0
    speed: float = 0.0
    share: float = 0.0
    apart: float = float("inf")
    ticks: int = 0
    steps: int = 0
    turned: int = 0
    near: int = 0

    @classmethod
    def of(cls, wall: Wall) -> "Sums":
        """Return those of no lines."""
        cells = int(-(-wall.height // CELL)), int(-(-wall.width // CELL))
        return cls(np.zeros(cells))

    def add(self, other: "Sums") -> None:
        """Add those of further lines."""
        self.apart = min(self.apart, other.apart)
        _add(self, other)


@dataclass
class Motors:
    """What the motors make of some lines, with a feed in mm/min or as fast as they can.

    Attributes
    ----------
    straight : array
        As of :class:`Sums`.
    late : float
        Longest time that a step was kept waiting, in clocks.
    steps, made, turned : int
        Steps that were requested, that were made, and of these those that took back another.
    """

    straight: NDArray[np.float64] = field(default_factory=_none)
    late: float = 0.0
    steps: int = 0
    made: int = 0
    turned: int = 0

    def add(self, other: "Motors") -> None:
        """Add what they make of further lines."""
        _add(self, other)


def wall() -> Wall:
    """Return the wall, on which it may draw nearer to the pulleys than by default."""
    return Wall(VPlotterSettings(least_y=BANDS[0]))


def random_line(seed: str, place: Wall) -> tuple[Point, Point]:
    """Return a line on the wall; every fourth is high up, and no steeper than by 150 mm."""
    rng = random.Random(seed)
    low, high = place.least_y, place.height
    if rng.random() < 0.25:
        low = rng.uniform(low, 500)
        high = low + 150
    begin, end = ((1000 * rng.randint(0, round(1000 * place.width)),
                   1000 * rng.randint(round(1000 * low), round(1000 * high))) for _ in range(2))
    return (begin, end) if begin != end else random_line(f"{seed} again", place)


def by_bands(y: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the highest value from each of the bands on."""
    return np.array([values[y >= band].max(initial=0) for band in BANDS])


def measure(lines: Sequence[tuple[Point, Point]], place: Wall) -> Sums:
    """Draw lines as fast as they can be drawn."""
    total = Sums.of(place)
    for begin, end in lines:
        total.add(_line(place.planned(begin, end), place))
    return total


def _line(line: PlannedLine, place: Wall) -> Sums:
    found, made = Sums.of(place), place.lengths(line)
    x, y = place.pen(made.left, made.right)
    off = line.off(x, y)
    found.straight, found.error = by_bands(y, off), made.error
    rows, columns = found.chart.shape
    cells = (np.minimum(y / CELL, rows - 1).astype(int) * columns
             + np.minimum(x / CELL, columns - 1).astype(int))
    starts = np.flatnonzero(np.concatenate([[True], np.diff(cells) != 0]))
    np.maximum.at(found.chart.reshape(-1), cells[starts], np.maximum.reduceat(off, starts))
    x, y = bowed(place, made.left[[0, -1]], made.right[[0, -1]])
    found.bowed = by_bands(y, line.off(x, y))
    _true(found, line, place)
    found.ticks = sum(abs(each) >> 8 for each in line.segment.increment)
    for lengths in made.left, made.right:
        asked = line.requests(made.ticks, lengths)
        between = np.diff(asked.times) * place.settings.clock
        back = asked.ways[1:] != asked.ways[:-1]
        found.steps += len(asked.times)
        found.turned += int(back.sum())
        found.near += int((between < place.settings.period).sum())
        found.apart = min(found.apart, float(between[~back].min(initial=np.inf)))
    return found


def bowed(place: Wall, *ends: NDArray[np.float64]) -> tuple[
        NDArray[np.float64], NDArray[np.float64]]:
    """Return where the pen hangs if each string goes from end to end at constant speed."""
    return place.pen(*(np.linspace(first, last, SAMPLES) for first, last in ends))


def _true(found: Sums, line: PlannedLine, place: Wall) -> None:
    """Compare speeds and accelerations of the true lengths with those of the path."""
    ends = float(line.times(np.array([line.length]))[0])
    apart = ends / SAMPLES
    points = line.points(line.along(np.linspace(0, ends, SAMPLES + 1)))
    way = np.hypot(*np.diff(points, axis=0).T)
    for lengths in place.string_lengths(points):
        by = np.diff(lengths)
        found.speed = max(found.speed, float((np.abs(by) / way).max()))
        acceleration = np.abs(np.diff(by)) / apart**2
        nearest = np.minimum(lengths[:-2], lengths[2:])  # the pen may pass below the pulley there
        allowed = line.speed**2 / np.maximum(nearest - way.max() / 2, 1e-9) + line.acceleration
        found.share = max(found.share, float((acceleration / allowed).max()))
        found.acceleration = np.maximum(found.acceleration,
                                        by_bands(points[1:-1, 1], acceleration))


def follow(lines: Sequence[tuple[Point, Point]], place: Wall, feed: float | None) -> Motors:
    """Draw lines with motors that rest a period after each step."""
    clock, total = place.settings.clock, Motors()
    for begin, end in lines:
        line = place.planned(begin, end, feed)
        made = place.lengths(line)
        times, lengths = [], []
        for wanted in made.left, made.right:
            asked = line.requests(made.ticks, wanted)
            done, late = followed(asked, place.settings.period / clock)
            times.append(done.times)
            lengths.append(wanted[0] + np.concatenate([[0], np.cumsum(done.ways)]))
            total.late = max(total.late, late * clock)
            total.steps += len(asked.times)
            total.made += len(done.times)
            total.turned += int((done.ways[1:] != done.ways[:-1]).sum())
        now = np.sort(np.concatenate(times))
        x, y = place.pen(*(each[np.searchsorted(at, now, side="right")]
                           for at, each in zip(times, lengths, strict=True)))
        total.straight = np.maximum(total.straight, by_bands(y, line.off(x, y)))
    return total
