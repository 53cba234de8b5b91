"""A line of the hanging plotter: ticks, lengths of its strings, and where its pen hangs then."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from fresa.machines.vplotter import VPlotterSettings
from fresa.motion import TICKS_LOG2
from tb.models.gcode_plan import Planner, PlanSettings
from tb.models.walk import Walked, line_steps
from tb.wall_plant import hanging

__all__ = ["Lengths", "PlannedLine", "Point", "Requests", "Wall", "followed", "nearest_lengths"]

Floats = NDArray[np.float64]
Point = tuple[int, int]
"""In nm from the left pulley, y down."""

CORNER = 34
"""Metres from where places are counted to where the machine is at 0: see `tb.models.gcode_plan`."""

SLICE = 1 << 15
"""Ticks that are computed at once: they stay in the cache."""


def nearest_lengths(across: Floats, below: Floats) -> tuple[Floats, Floats]:
    """Return the lengths that are nearest to those of a string, in steps, and the true ones.

    Of two that are as near it is the shorter. Places are whole numbers of ticks, below 2**26, so
    the root of a square that is half way is exact, and no other comes near enough to be rounded to
    it.
    """
    true = np.sqrt(across * across + below * below) / (1 << TICKS_LOG2)
    return np.ceil(true - 0.5), true


@dataclass(frozen=True)
class Requests:
    """Steps that are requested of a motor: instants in seconds, and 1 where the string pays out."""

    times: Floats
    ways: Floats


def followed(requests: Requests, period: float) -> tuple[Requests, float]:
    """Return the steps that a :class:`StringMotor` makes, and the longest time one is late.

    A step is made when the motor has rested for a period, if it is still wanted then.
    """
    times, ways = [], []
    behind, since, rested, late = 0, 0.0, -1e9, 0.0
    ends = [*requests.times.tolist(), float("inf")]
    for (now, then), way in zip(pairwise(ends), requests.ways.tolist(), strict=True):
        since = since if behind else now
        behind += int(way)
        while behind and (at := max(now, rested)) < then:
            made = 1 if behind > 0 else -1
            times.append(at)
            ways.append(made)
            late = max(late, at - since)
            behind, since, rested = behind - made, at, at + period
    return Requests(np.array(times), np.array(ways, float)), late


@dataclass(frozen=True)
class Lengths:
    """Lengths of both strings in steps, at first and after each tick that changes one.

    Attributes
    ----------
    ticks : array of int
        Of the profile, from 0.
    left, right : array
        Lengths.
    error : float
        By how much a string was off at most, after any tick, in steps.
    """

    ticks: NDArray[np.int64]
    left: Floats
    right: Floats
    error: float


@dataclass(frozen=True)
class PlannedLine:
    """A line from rest to rest, as it is planned.

    Attributes
    ----------
    begin, end : Point
        As asked for.
    segment : Walked
        What the walk takes.
    first : (int, int)
        Where it begins, in ticks from the left pulley, y down.
    length, speed, acceleration : float
        Of the path, in mm and seconds.
    """

    begin: Point
    end: Point
    segment: Walked
    first: tuple[int, int]
    length: float
    speed: float
    acceleration: float

    def places(self) -> Iterator[tuple[NDArray[np.int64], Floats, Floats]]:
        """Yield, slice by slice, ticks and where they lead: across and below, from the begin."""
        segment = self.segment
        made = [line_steps(segment.start[axis], segment.increment[axis], segment.log2_ticks)
                for axis in range(2)]
        ticks = np.concatenate([np.zeros(1, np.int64), *made])
        ticks.sort(kind="stable")  # a merge
        for begin in range(0, len(ticks), SLICE):
            some = ticks[begin:begin + SLICE]
            x, y = ((start + (some * increment >> segment.log2_ticks) >> 8).astype(float)
                    for start, increment in zip(segment.start[:2], segment.increment[:2],
                                                strict=True))
            yield some, self.first[0] + x, self.first[1] - y

    def times(self, along: Floats) -> Floats:
        """Return when the path has come so far, in mm: it speeds up, goes on, and slows down."""
        ramp, top = self._ramp()
        rise = top / self.acceleration
        ends = 2 * rise + (self.length - 2 * ramp) / top
        left = np.maximum(self.length - along, 0)
        return np.where(
            along < ramp, np.sqrt(2 * along / self.acceleration),
            np.where(left > ramp, rise + (along - ramp) / top,
                     ends - np.sqrt(2 * left / self.acceleration)))

    def along(self, times: Floats) -> Floats:
        """Return how far the path has come then: the inverse of :meth:`times`."""
        ramp, top = self._ramp()
        rise = top / self.acceleration
        left = np.maximum(2 * rise + (self.length - 2 * ramp) / top - times, 0)
        return np.where(
            times < rise, self.acceleration * times**2 / 2,
            np.where(left > rise, ramp + top * (times - rise),
                     self.length - self.acceleration * left**2 / 2))

    def _ramp(self) -> tuple[float, float]:
        """Return how long it speeds up, in mm, and to what speed."""
        ramp = min(self.speed**2 / self.acceleration, self.length) / 2
        return ramp, sqrt(2 * ramp * self.acceleration)

    def points(self, along: Floats) -> Floats:
        """Return points of the line that was asked for, in mm."""
        begin, end = np.array(self.begin) / 1e6, np.array(self.end) / 1e6
        return begin + (end - begin) * (along / self.length)[:, np.newaxis]

    def off(self, x: Floats, y: Floats) -> Floats:
        """Return how far places in mm are from the line that was asked for."""
        (a, b), (c, d) = ((at / 1e6 for at in point) for point in (self.begin, self.end))
        u, v = (c - a) / self.length, (d - b) / self.length
        x, y = x - a, y - b
        along = np.clip(x * u + y * v, 0, self.length)
        return np.hypot(x - along * u, y - along * v)

    def requests(self, ticks: NDArray[np.int64], lengths: Floats) -> Requests:
        """Return the steps of a string, of lengths after these ticks."""
        ways = np.diff(lengths)
        found = np.flatnonzero(ways)
        part = ticks[found + 1] / 2.0**self.segment.log2_ticks
        return Requests(self.times(part * self.length), ways[found])


class Wall:
    """A hanging plotter: what it makes of a line, and where its pen hangs.

    Parameters
    ----------
    settings : VPlotterSettings
        Its wall and limits.
    steps_per_mm : float
        Half steps of its motors per mm of string, an eighth of $100 unless given: what the motors
        of the settings make, but for the thousandth to which $100 is rounded.

    Attributes
    ----------
    plan : PlanSettings
        What it plans by.
    width, height, least_y : float
        Wall in mm. The left pulley is up to a tick farther to the left, so that whole ticks are
        between both.
    """

    def __init__(self, settings: VPlotterSettings, steps_per_mm: float | None = None) -> None:
        self.settings = settings
        self.plan = PlanSettings.stored(settings.clock, settings.store)
        self.width, self.height = float(settings.wall_width), float(settings.wall_height)
        self.least_y, self.per_mm = float(settings.least_y), self.plan.steps[0] / 1000
        self.steps_per_mm = steps_per_mm or settings.steps_of_string
        self._across, self._top = settings.wall_ticks, settings.ticks(settings.least_y)
        # A wall is whole ticks wide, and its place counted from the right: so it hangs to the left.
        self._left = self.width - self._across / self.per_mm

    def planned(self, begin: Point, end: Point, feed: float | None = None) -> PlannedLine:
        """Plan a line, with a feed in mm/min if not as fast as can be."""
        planner = Planner(self.plan, self._of_machine(begin))
        before = planner.places(planner.position)
        block = planner.line(self._of_machine(end),
                             None if feed is None else round(feed * 1e6 / 60))
        if block is None:
            raise ValueError("a line has to have a length")
        far = [abs(to - at) / 1e6 for at, to in zip(begin, end, strict=True)]
        length = hypot(*far)
        lowest = [(at + 128 >> 8) - CORNER * steps for at, steps in zip(
            before, self.plan.steps, strict=True)]
        segment = Walked(increment=[to - at for at, to in zip(before, block.place, strict=True)],
                         start=[at + 128 & 255 for at in before], log2_ticks=block.log2_ticks)
        return PlannedLine(
            begin, end, segment, (self._across + lowest[0], self._top - lowest[1]), length,
            sqrt(block.nominal) / 1e6,
            min(limit / 1e6 * length / part for limit, part in zip(
                self.plan.accelerations, far, strict=False) if part))

    def _of_machine(self, point: Point) -> tuple[int, int, int]:
        """Return a point as the machine counts: 0 is the upper right corner, y goes up."""
        return (point[0] - self.settings.wall_width * 10**6,
                self.settings.least_y * 10**6 - point[1], 0)

    def lengths(self, line: PlannedLine) -> Lengths:
        """Return the lengths of the strings along a line."""
        found, before, error = [], (-1.0, -1.0), 0.0
        for ticks, across, below in line.places():
            (left, true_left), (right, true_right) = (
                nearest_lengths(each, below) for each in (across, self._across - across))
            error = max(error, float(np.abs(left - true_left).max()),
                        float(np.abs(right - true_right).max()))
            changed = np.empty(len(ticks), bool)
            changed[0] = before != (left[0], right[0])
            np.not_equal(left[1:], left[:-1], out=changed[1:])
            changed[1:] |= right[1:] != right[:-1]
            found.append([each[changed] for each in (ticks, left, right)])
            before = left[-1], right[-1]
        ticks, left, right = (np.concatenate(each) for each in zip(*found, strict=True))
        return Lengths(ticks, left, right, error)

    def pen(self, left: Floats, right: Floats) -> tuple[Floats, Floats]:
        """Return where the pen hangs of strings of so many steps, in mm."""
        place = hanging(left / self.steps_per_mm, right / self.steps_per_mm,
                        self.width - self._left)
        return place.real + self._left, place.imag

    def farthest(self, x: Floats, y: Floats) -> Floats:
        """Return how far from a place the pen can be, in mm, by rounding alone.

        Each coordinate is half a tick off, and each string half a step.
        """
        tick, most = 0.5 + 1 / 256, np.zeros(np.broadcast(x, y).shape)
        for corner in range(16):
            by = [1 if corner >> bit & 1 else -1 for bit in range(4)]
            across = self._across - (self.width - x) * self.per_mm + by[0] * tick
            below = self._top - (self.least_y - y) * self.per_mm + by[1] * tick
            left, right = (np.hypot(each, below) / (1 << TICKS_LOG2) + off / 2 for each, off in (
                (across, by[2]), (self._across - across, by[3])))
            most = np.maximum(most, np.hypot(*(at - to for at, to in zip(
                self.pen(left, right), (x, y), strict=True))))
        return most

    def string_lengths(self, points: Floats) -> Sequence[Floats]:
        """Return the true lengths of both strings to points, in mm."""
        return [np.hypot(points[:, 0] - across, points[:, 1])
                for across in (self._left, self.width)]
