"""The path that a program asks for, exactly: lines and arcs, from the model of the language."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import atan2, ceil, cos, hypot, pi, sin, sqrt, tau
from typing import NamedTuple

from tb.models.gcode_language import Arc, Interpreter, Line, Probe, words

__all__ = ["Asked", "Curve", "Follower", "Nearest", "Point", "Segment", "Straight"]

Point = tuple[float, float, float]
"""X, Y and Z in mm, in the machine's coordinates."""

NM = 1e6
"""Nanometres in a mm."""

CHANGES = re.compile(r".*=.*|\$(C|SLP|H[XYZ]?)")
"""Commands that move, or change what later lines do."""

STRAY_MM = 1e-5
"""Where an arc's end is farther than this from its circle, a line leads there."""


class Nearest(NamedTuple):
    """The place of a segment that is nearest to a point: how far it is, and where, in mm."""

    distance: float
    along: float


@dataclass(frozen=True)
class Straight:
    """A line; `rapid` is that of G0."""

    start: Point
    end: Point
    rapid: bool = False

    @property
    def length(self) -> float:
        """In mm."""
        return _apart(self.start, self.end)

    def nearest(self, point: Point, near: float) -> Nearest:
        """Return the nearest place; a line needs no hint where it is."""
        a, b, length = self.start, self.end, self.length
        x, y, z = ((b[n] - a[n]) / length for n in range(3)) if length else (0.0, 0.0, 0.0)
        u, v, w = point[0] - a[0], point[1] - a[1], point[2] - a[2]
        along = min(max(u * x + v * y + w * z, 0.0), length)
        u, v, w = u - along * x, v - along * y, w - along * z
        return Nearest(sqrt(u * u + v * v + w * w), along)

    def points(self, deviation: float) -> list[Point]:
        """Return its ends."""
        return [self.start, self.end]


@dataclass(frozen=True)
class Curve:
    """An arc or helix.

    Attributes
    ----------
    centre : tuple of float
        In the axes of the plane.
    radius, begin, sweep : float
        Radius, angle of its start, and by how much it turns; counter-clockwise is positive.
    low, rise : float
        The third axis at the start, and by how much it goes on.
    plane : tuple of int
        The axes of the plane.
    """

    centre: tuple[float, float]
    radius: float
    begin: float
    sweep: float
    low: float
    rise: float
    plane: tuple[int, int]
    rapid = False

    @property
    def length(self) -> float:
        """In mm."""
        return hypot(self.radius * self.sweep, self.rise)

    def at(self, part: float) -> Point:
        """Return the place after a part of it, from 0 to 1."""
        angle = self.begin + part * self.sweep
        a, b = self.plane
        place = [0.0] * 3
        place[a] = self.centre[0] + self.radius * cos(angle)
        place[b] = self.centre[1] + self.radius * sin(angle)
        place[3 - a - b] = self.low + part * self.rise
        return place[0], place[1], place[2]

    @property
    def start(self) -> Point:
        """Where it begins."""
        return self.at(0)

    @property
    def end(self) -> Point:
        """Where it ends."""
        return self.at(1)

    def nearest(self, point: Point, near: float) -> Nearest:
        """Return the place that is nearest, of its turns the one nearest to `near` along it."""
        a, b = self.plane
        u, v = point[a] - self.centre[0], point[b] - self.centre[1]
        length = self.length
        expected = self.begin + near / length * self.sweep
        angle = expected + (atan2(v, u) - expected + pi) % tau - pi
        part = (angle - self.begin) / self.sweep
        if not 0 <= part <= 1:
            part = min(max(part, 0.0), 1.0)
            return Nearest(_apart(point, self.at(part)), part * length)
        out = hypot(u, v) - self.radius
        up = point[3 - a - b] - self.low - part * self.rise
        slope = up * self.rise / length  # what of it is along the helix
        along = min(max(part * length + slope, 0.0), length)
        return Nearest(sqrt(max(out * out + up * up - slope * slope, 0.0)), along)

    def points(self, deviation: float) -> list[Point]:
        """Return points of it whose chords are no farther from it than this."""
        turn = 2 * sqrt(2 * min(deviation / self.radius, 0.5))
        count = max(1, ceil(abs(self.sweep) / turn))
        return [self.at(n / count) for n in range(count + 1)]


Segment = Straight | Curve


class Asked:
    """What a program asks for, line by line.

    Parameters
    ----------
    steps_per_metre : sequence of int
        Of X, Y and Z, of which arcs have a limit; 0 for any number.

    Attributes
    ----------
    segments : list of Segment
        The path so far, from the origin on, of those that have a length.
    """

    def __init__(self, steps_per_metre: Sequence[int] = (0, 0, 0)) -> None:
        self._machine = Interpreter(steps_per_metre=steps_per_metre)
        self._at: Point = (0.0, 0.0, 0.0)
        self.segments: list[Segment] = []

    def add(self, line: str) -> None:
        """Add what a line does. Of ``$`` commands the model has none.

        Raises
        ------
        RefusedLine
            If it is refused, with GRBL's code.
        ValueError
            If it is a ``$`` command that moves or changes what later lines do, or a probing.
        """
        if line.startswith("$"):
            if CHANGES.fullmatch("".join(line.upper().split())):
                raise ValueError(f"the path behind {line!r} is not known here: leave it out, and "
                                 "give settings as options")
            return
        for action in self._machine.line(words(line)):
            if isinstance(action, Probe):
                raise ValueError(f"the path behind {line!r} is not known here, where nothing "
                                 "touches: leave it out")
            if isinstance(action, Line | Arc):
                self._go(action)

    def _go(self, action: Line | Arc) -> None:
        at, end = self._at, _point(action.target)
        if isinstance(action, Arc):
            curve = _curve(at, action)
            self.segments.append(curve)
            at = end if _apart(curve.end, end) < STRAY_MM else curve.end
        if at != end:
            self.segments.append(
                Straight(at, end, isinstance(action, Line) and action.feed is None))
        self._at = end


def _curve(at: Point, arc: Arc) -> Curve:
    """Return the arc on the circle of its start; a full one if it ends in the same direction."""
    a, b = arc.plane
    u, v = (each / NM for each in arc.centre)
    end = _point(arc.target)
    begin = atan2(-v, -u)
    sweep = (atan2(end[b] - at[b] - v, end[a] - at[a] - u) - begin) % tau
    if arc.target[a] / NM == at[a] and arc.target[b] / NM == at[b] or not sweep:
        sweep = tau
        if arc.clockwise:
            sweep = -tau
    elif arc.clockwise:
        sweep -= tau
    third = 3 - a - b
    return Curve((at[a] + u, at[b] + v), hypot(u, v), begin, sweep, at[third],
                 end[third] - at[third], (a, b))


def _point(place: Sequence[int]) -> Point:
    x, y, z = (each / NM for each in place)
    return x, y, z


def _apart(a: Sequence[float], b: Sequence[float]) -> float:
    return sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


class Follower:
    """Follows a path, point by point, and says how far each is from it.

    It goes on to the next segment where that is nearer, once it is at the end of this one or away
    from it. So a point is compared with its own part of a path that crosses itself.

    Parameters
    ----------
    segments : iterable of Segment
        The path.
    reach : float
        How far the end of a segment, and the path, may be from a point that belongs there, in mm.

    Attributes
    ----------
    done : float
        Length of the path up to the last point.
    """

    def __init__(self, segments: Iterable[Segment], reach: float) -> None:
        self._segments, self._reach = iter(segments), reach
        self._now, self._next = next(self._segments, None), next(self._segments, None)
        self._along = self._before = 0.0

    @property
    def done(self) -> float:
        return self._before + self._along

    def distance(self, point: Point) -> float:
        """Return how far a point is from the path, in mm; it comes after those before."""
        if self._now is None:
            return 0.0
        seen = self._now.nearest(point, self._along)
        while self._next is not None:
            length = self._now.length
            if length - seen.along > self._reach and seen.distance <= self._reach:
                break
            following = self._next.nearest(point, 0.0)
            if following.distance > seen.distance:
                break
            if following.distance == seen.distance and seen.along < length:
                break
            self._before += length
            self._now, self._next, seen = self._next, next(self._segments, None), following
        self._along = seen.along
        return seen.distance
