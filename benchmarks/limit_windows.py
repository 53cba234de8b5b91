"""Speeds and accelerations from the instants of steps, with what is not known of them.

At a rising edge of STEP its axis passes from one step to the next, so its place is known then: of
a line but for the time of a tick and some clocks, of an arc to a quarter of a step besides. The
second divided difference of three places is a mean of the acceleration between the first and the
last of them, so it is within every limit that the acceleration is within, but for the error of the
places over the square of their distance in time. Windows are as long as makes that small.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from .limit_programs import NM, Limits, Piece, Program

__all__ = ["QUANTITIES", "AlignmentError", "Found", "measure"]

QUANTITIES = (
    "speed of an axis", "speed of a line", "speed along an arc",
    "acceleration of an axis, lines", "acceleration of an axis, arcs",
    "acceleration in the plane of an arc", "step of velocity at a corner of lines",
    "step of velocity at an end of an arc")

SHARE = 0.03
"""Share of a limit that windows are to resolve; of a speed a sixth of that."""

COARSE = 0.12
"""Share of a limit beyond which nothing is said to be measured."""

TIME = 16
"""Clocks by which an edge may be off: a tick of four, and eight that a tick is off, and some."""

PLACE = 1 / 128, 1 / 4
"""Steps by which the place of an edge may be off: of a line, and in the plane of an arc."""

DROPPED = 3
"""Edges at the ends of an arc that are left out: the last may correct its end."""

STRAIGHT = 1e-6
"""Turn in rad below which two blocks are one line."""

Array = NDArray[np.float64]


class AlignmentError(RuntimeError):
    """The steps at the pins are not those of the program."""


@dataclass(frozen=True)
class Found:
    """A quantity of a program.

    Attributes
    ----------
    quantity : str
        One of `QUANTITIES`.
    ratio, least : array
        What was measured in each window, over its limit; and the same less its error.
    """

    quantity: str
    ratio: Array
    least: Array


@dataclass(frozen=True)
class _Edges:
    """Edges of an axis: seconds, places in mm, and steps behind each of them."""

    time: Array
    place: Array
    after: NDArray[np.int64]
    step: float

    def part(self, first: int, last: int) -> "_Edges":
        return _Edges(self.time[first:last], self.place[first:last], self.after[first:last],
                      self.step)

    def at(self, times: Array, error: float, acceleration: float) -> tuple[Array, Array]:
        """Return places between edges, and by how much they may be off."""
        if len(self.time) < 2:
            return np.zeros_like(times), np.full_like(times, self.step)
        behind = np.clip(np.searchsorted(self.time, times), 1, len(self.time) - 1)
        gap = self.time[behind] - self.time[behind - 1]
        outside = (times < self.time[0]) | (times > self.time[-1])
        bow = np.where(outside, self.step, np.minimum(self.step, acceleration * gap**2 / 8))
        return np.interp(times, self.time, self.place), error + bow


@dataclass(frozen=True)
class _Speed:
    """Speed along the path at an end of a block: extrapolated, and within what bounds."""

    value: float
    least: float
    most: float


def measure(program: Program, clock: int, edges: Sequence[NDArray[np.int64]],
            ways: Sequence[NDArray[np.int64]], claim: float = 1.0) -> Iterator[Found]:
    """Measure a program.

    Parameters
    ----------
    program : Program
        What was sent.
    clock : int
        In Hz.
    edges, ways : sequence of array
        Of each axis the clocks of its rising edges, and 1 for those forward, -1 for those back.
    claim : float
        Part of the limits that are set which is claimed to be their whole.

    Raises
    ------
    AlignmentError
        If there are other steps than the program has.
    """
    of = program.limits
    limits = Limits(of.steps, tuple(claim * each for each in of.rates),
                    tuple(claim * each for each in of.accelerations), of.deviation)
    axes = []
    for clocks, way, per_mm in zip(edges, ways, limits.steps, strict=True):
        after = np.cumsum(way)
        axes.append(_Edges(clocks / clock, (after - way / 2) / per_mm, after, 1 / per_mm))
    blocks = [_Block(piece, own, axes, limits, claim, TIME / clock)
              for piece, own in zip(program.pieces, _cut(program, axes), strict=True)]
    for block in blocks:
        yield from block.speeds()
        yield from block.accelerations()
    for before, after in zip(blocks, blocks[1:], strict=False):
        yield from _junction(before, after, claim)


def _cut(program: Program, axes: Sequence[_Edges]) -> list[list[tuple[int, int]]]:
    """Return of each block and axis which edges are its own.

    An axis that turns round in an arc may leave out a step there and back.
    """
    places, found = [0, 0, 0], []
    for piece in program.pieces:
        own = []
        for axis, count in enumerate(piece.edges(program.limits.steps)):
            first, edges = places[axis], axes[axis]
            end = (piece.end[axis] * program.limits.steps[axis] * 2 + NM) // (2 * NM)
            for by in (0, -2, 2, -4, 4) if piece.arc else (0,):
                last = first + count + by
                reached = (edges.after[last - 1] if 0 < last <= len(edges.after)
                           else 0 if last == 0 else None)
                if last >= first and reached == end:
                    break
            else:
                raise AlignmentError(f"axis {'XYZ'[axis]} does not make the {count} steps of block "
                                     f"{len(found)} to {end}")
            own.append((first, last))
            places[axis] = last
        found.append(own)
    for axis, edges in enumerate(axes):
        if places[axis] != len(edges.after):
            raise AlignmentError(f"axis {'XYZ'[axis]} makes {len(edges.after) - places[axis]} "
                                 "steps behind the program")
    return found


class _Block:
    """A block and its edges."""

    def __init__(self, piece: Piece, own: Sequence[tuple[int, int]], axes: Sequence[_Edges],
                 limits: Limits, claim: float, time: float) -> None:
        self.piece, self.limits, self._axes = piece, limits, axes
        self.feed = claim * piece.feed
        self._units = [np.abs(piece.unit(end=end)) for end in (False, True)]
        top = min([piece.feed, *(
            rate / part for rate, part in zip(limits.rates, self._parts(), strict=True) if part)])
        self._error = [parts * top * time + self._place(axis) / limits.steps[axis]
                       for axis, parts in enumerate(self._parts())]
        self.own = []
        for axis, (first, last) in enumerate(own):
            left = DROPPED if self._curved(axis) else 1
            right = DROPPED if self._curved(axis) else 0
            self.own.append(axes[axis].part(min(first + left, last), max(first, last - right)))

    def _parts(self) -> Array:
        """Return the greatest part of the speed along the path that each axis has."""
        if self.piece.arc is None:
            return self._units[0]
        parts = np.ones(3)
        across = self.piece.arc.axes[2]
        parts[across] = self._units[0][across]
        return parts

    def _curved(self, axis: int) -> bool:
        return self.piece.arc is not None and axis in self.piece.arc.axes[:2]

    def _place(self, axis: int) -> float:
        return PLACE[self._curved(axis)]

    def accelerations(self) -> Iterator[Found]:
        """Yield the accelerations of each axis, and of both in the plane of an arc."""
        kind = "lines" if self.piece.arc is None else "arcs"
        for axis, edges in enumerate(self.own):
            limit = self.limits.accelerations[axis]
            error = self._error[axis]
            half = sqrt(4 * error / (SHARE * limit))
            time, place = edges.time, edges.place
            left = np.searchsorted(time, time - half, "right") - 1
            right = np.searchsorted(time, time + half, "left")
            at = np.flatnonzero((left >= 0) & (right < len(time)))
            if len(at):
                value, off = _second([time[which] for which in (left[at], at, right[at])],
                                     [place[which] for which in (left[at], at, right[at])],
                                     [np.full(len(at), error)] * 3)
                yield _found(f"acceleration of an axis, {kind}", np.abs(value), off, limit)
        if self.piece.arc is not None:
            yield from self._in_plane()

    def _in_plane(self) -> Iterator[Found]:
        axes = self.piece.arc.axes[:2] if self.piece.arc else ()
        limit = min(self.limits.accelerations[axis] for axis in axes)
        half = sqrt(4 * sqrt(sum(self._error[axis]**2 for axis in axes)) / (SHARE * limit))
        first, last = self._span(axes)
        if last - first <= 2 * half:
            return
        middle = np.linspace(first + half, last - half, 400)
        times = [middle - half, middle, middle + half]
        parts = []
        for axis in axes:
            places, errors = zip(*(self._axes[axis].at(
                time, self._error[axis], self.limits.accelerations[axis]) for time in times),
                strict=True)
            parts.append(_second(times, places, errors))
        value, off = (np.hypot(*each) for each in zip(*parts, strict=True))
        yield _found("acceleration in the plane of an arc", value, off, limit)

    def _span(self, axes: Sequence[int]) -> tuple[float, float]:
        """Return from when to when edges of axes are known to be of this block."""
        own = [self.own[axis].time for axis in axes]
        if any(len(each) < 2 for each in own):
            return 0.0, 0.0
        return max(each[0] for each in own), min(each[-1] for each in own)

    def speeds(self) -> Iterator[Found]:
        """Yield the speeds of each axis, and along the path."""
        for axis, edges in enumerate(self.own):
            limits = [("speed of an axis", self.limits.rates[axis])]
            part = self._units[0][axis]
            if self.piece.arc is None and axis == self._units[0].argmax() and self.feed < inf:
                limits.append(("speed of a line", self.feed * part))
            for quantity, limit in limits:
                error = self._error[axis]
                right = np.searchsorted(edges.time, edges.time + 12 * error / (SHARE * limit))
                at = np.flatnonzero(right < len(edges.time))
                if len(at):
                    span = edges.time[right[at]] - edges.time[at]
                    yield _found(quantity, np.abs(edges.place[right[at]] - edges.place[at]) / span,
                                 2 * error / span, limit)
        if self.piece.arc is not None:
            first, last = self._span(self.piece.arc.axes[:2])
            span = 12 * max(self._error) / (SHARE * self.feed)
            if last - first > span:
                begins = np.linspace(first, last - span, 400)
                yield _found("speed along an arc", *self._chords(begins, begins + span), self.feed)

    def _chords(self, begins: Array, ends: Array) -> tuple[Array, Array]:
        """Return speeds along the path of an arc between two instants, and their errors."""
        square, off, flat = np.zeros_like(begins), np.zeros_like(begins), np.zeros_like(begins)
        for axis, edges in enumerate(self._axes):
            of = self._error[axis], self.limits.accelerations[axis]
            (before, error), (after, other) = edges.at(begins, *of), edges.at(ends, *of)
            if self._curved(axis):
                flat += (after - before)**2
            else:
                square += (after - before)**2
            off += (error + other)**2
        radius = self.piece.arc.radius if self.piece.arc else inf
        along = 2 * radius * np.arcsin(np.minimum(1, np.sqrt(flat) / (2 * radius)))
        return np.sqrt(square + along**2) / (ends - begins), np.sqrt(off) / (ends - begins)

    def at_end(self, *, end: bool) -> _Speed | None:
        """Return the speed at the begin or the end; None if there are too few steps."""
        unit = self._units[end]
        axes = self._plane() if self.piece.arc else [int(unit.argmax())]
        most = min(limit / part for limit, part in zip(
            self.limits.accelerations, self._parts(), strict=True) if part)
        if self.piece.arc:
            most = min(self.limits.accelerations[axis] for axis in axes) / sqrt(
                sum(unit[axis]**2 for axis in axes))
        first, last = self._span(axes)
        if last <= first:
            return None
        scale = 1 if self.piece.arc else 1 / unit[axes[0]]
        error = scale * sqrt(sum(self._error[axis]**2 for axis in axes))
        half = min(sqrt(4 * error / most), (last - first) / 2)
        at = last if end else first
        toward = -1 if end else 1
        times = np.sort([at, at + toward * half, at + 2 * toward * half])[::toward]
        if self.piece.arc:
            near, far = (self._chords(*np.sort([times[place:place + 2]]).T)
                         for place in (0, 1))
        else:
            near, far = (self._mean(axes[0], times[place], times[place + 1], scale)
                         for place in (0, 1))
        speeds = [float(np.squeeze(each[0])) for each in (near, far)]
        off = float(np.squeeze(near[1]))
        rest = self._rest(axes, at, end=end)
        slope = (speeds[0] - speeds[1]) / half
        near_by = most * half / 2 + off
        least = _after(max(0.0, speeds[0] - near_by), -most, rest)
        upper = _after(speeds[0] + near_by, most, rest)
        value = _after(max(0.0, speeds[0] + slope * half / 2), slope, rest)
        return _Speed(min(max(value, least), upper), least, upper)

    def _plane(self) -> list[int]:
        return list(self.piece.arc.axes[:2]) if self.piece.arc else []

    def _mean(self, axis: int, begin: float, end: float, scale: float) -> tuple[Array, Array]:
        """Return the mean speed of a line between two instants, and its error."""
        of = self._error[axis], self.limits.accelerations[axis]
        times = np.array([begin, end])
        place, error = self.own[axis].at(times, *of)
        span = abs(end - begin)
        return (np.array(scale * abs(place[1] - place[0]) / span),
                np.array(scale * error.sum() / span))

    def _rest(self, axes: Sequence[int], at: float, *, end: bool) -> float:
        """Return how much path there is between an instant and the begin or the end."""
        goal = self.piece.end if end else self.piece.begin
        here = np.array([float(self._axes[axis].at(np.array([at]), 0.0, 0.0)[0][0])
                         for axis in axes])
        there = np.array([goal[axis] / NM for axis in axes])
        if self.piece.arc is None:
            return float(abs(there - here)[0] / self._units[end][axes[0]])
        part = sqrt(sum(self._units[end][axis]**2 for axis in axes))
        return float(np.linalg.norm(there - here)) / part


def _after(speed: float, acceleration: float, path: float) -> float:
    """Return the speed behind so much path."""
    return sqrt(max(0.0, speed**2 + 2 * acceleration * path))


def _second(times: Sequence[Array], places: Sequence[Array], errors: Sequence[Array]
            ) -> tuple[Array, Array]:
    """Return the mean acceleration of three places, and by how much it may be off."""
    before, behind = times[1] - times[0], times[2] - times[1]
    scale = 2 / (before + behind)
    return (scale * ((places[2] - places[1]) / behind - (places[1] - places[0]) / before),
            scale * ((errors[2] + errors[1]) / behind + (errors[1] + errors[0]) / before))


def _found(quantity: str, value: Array, off: Array, limit: float) -> Found:
    """Return what was measured, without windows that resolve too little."""
    fine = off <= COARSE * limit
    return Found(quantity, value[fine] / limit, (value - off)[fine] / limit)


def _junction(before: _Block, after: _Block, claim: float) -> Iterator[Found]:
    """Yield the step of velocity between two blocks, if there are steps enough to tell it."""
    units = before.piece.unit(end=True), after.piece.unit(end=False)
    change = units[1] - units[0]
    turn = float(np.linalg.norm(change))  # twice the sine of half the angle
    first, second = before.at_end(end=True), after.at_end(end=False)
    quantity = QUANTITIES[6 + (before.piece.arc is not None or after.piece.arc is not None)]
    if turn < STRAIGHT:
        return
    limit = turn * _corner_speed(change / turn, turn, before.limits, claim)
    if first is None or second is None or not limit:
        yield Found(quantity, np.zeros(0), np.zeros(0))
        return
    cosine = float(units[0] @ units[1])

    def step(one: float, other: float) -> float:
        return sqrt(max(0.0, one**2 + other**2 - 2 * one * other * cosine))

    value = step(first.value, second.value)
    # The least of a convex function whose bottom is outside of the bounds is at one of them.
    least = min(step(of, min(max(of * cosine, other.least), other.most))
                for one, other in ((first, second), (second, first))
                for of in (one.least, one.most))
    yield _found(quantity, np.array([value]), np.array([value - least]), limit)


def _corner_speed(way: Array, turn: float, limits: Limits, claim: float) -> float:
    """Return the speed at a corner that GRBL's junction deviation allows.

    `way` is the direction in which the velocity changes.
    """
    acceleration = min(limit / abs(part) for limit, part in zip(
        limits.accelerations, way, strict=True) if part) / claim
    sine = sqrt(max(0.0, 1 - turn**2 / 4))  # of half the angle between both paths
    return claim * sqrt(acceleration * limits.deviation * sine / (1 - sine))
