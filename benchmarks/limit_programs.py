"""Random programs for the limits of the G-code machine, with their geometry in real numbers."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import cos, floor, hypot, inf, isclose, pi, sin

import numpy as np
from numpy.typing import NDArray

__all__ = ["KINDS", "Arc", "Limits", "Piece", "Program", "program"]

NM = 1_000_000
"""In a mm."""

MOST_RATE = 450_000
"""Steps/s of an axis at most."""

FASTEST = 2_000.0
"""mm/s of an axis at most: more than $110 takes would be refused."""

STEPS_PER_MM = (400, 500, 800, 1600, 3200)
FINE_STEPS_PER_MM = (1600, 2000, 2500, 3200)
"""For arcs, of which a place is known to a quarter of a step."""

PLANES = (("G17", (0, 1, 2), "IJ"), ("G18", (2, 0, 1), "KI"), ("G19", (1, 2, 0), "JK"))


@dataclass(frozen=True)
class Limits:
    """What a machine is set to: steps/mm, mm/s and mm/s² of each axis, and $11 in mm."""

    steps: tuple[int, ...]
    rates: tuple[float, ...]
    accelerations: tuple[float, ...]
    deviation: float


@dataclass(frozen=True)
class Arc:
    """The curve of an arc: its axes, those of the plane first; centre and radius in mm; angles."""

    axes: tuple[int, int, int]
    centre: tuple[float, float]
    radius: float
    angle: float
    sweep: float


@dataclass(frozen=True)
class Piece:
    """A line or an arc from one place to another, in nm, with a feed in mm/s."""

    begin: tuple[int, ...]
    end: tuple[int, ...]
    feed: float
    arc: Arc | None = None

    @property
    def length(self) -> float:
        """Length of the path in mm."""
        if self.arc is None:
            return float(np.linalg.norm(np.subtract(self.end, self.begin))) / NM
        return hypot(self.arc.radius * self.arc.sweep, self._across)

    @property
    def _across(self) -> float:
        axis = self.arc.axes[2] if self.arc else 0
        return (self.end[axis] - self.begin[axis]) / NM

    def unit(self, *, end: bool) -> NDArray[np.float64]:
        """Return the direction of the path at its begin, or at its end."""
        if self.arc is None:
            return np.subtract(self.end, self.begin) / NM / self.length
        u, v, w = self.arc.axes
        angle = self.arc.angle + end * self.arc.sweep
        along = self.arc.radius * self.arc.sweep / self.length
        found = np.zeros(3)
        found[[u, v, w]] = -sin(angle) * along, cos(angle) * along, self._across / self.length
        return found

    def edges(self, steps: Sequence[int]) -> list[int]:
        """Return how many steps each axis makes, there and back."""
        ends = [_step(self.begin, steps), _step(self.end, steps)]
        made = [abs(after - before) for before, after in zip(*ends, strict=True)]
        if self.arc is None:
            return made
        for axis, centre, turned in zip(self.arc.axes, self.arc.centre, (0.0, pi / 2),
                                        strict=False):
            # The extremes of the axis are whole multiples of pi from there.
            first, last = sorted((self.arc.angle, self.arc.angle + self.arc.sweep))
            numbers = range(floor((first - turned) / pi) + 1, floor((last - turned) / pi) + 1)
            way = 1 if self.arc.sweep > 0 else -1
            places = [ends[0][axis], *(
                floor((centre + self.arc.radius * (-1) ** number) * steps[axis] + 0.5)
                for number in numbers[::way]), ends[1][axis]]
            made[axis] = int(np.abs(np.diff(places)).sum())
        return made


@dataclass
class Program:
    """Lines of G-code, and what they are."""

    limits: Limits
    lines: list[str] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    at: tuple[int, ...] = (0, 0, 0)

    @property
    def settings(self) -> list[str]:
        """Lines that set the machine; a rate comes behind the steps, with which it is checked."""
        of = self.limits
        return [f"$11={of.deviation:.3f}", *(
            f"${number + axis}={value:.3f}" for number, values in (
                (100, of.steps), (110, [60 * rate for rate in of.rates]), (120, of.accelerations))
            for axis, value in enumerate(values))]

    def line(self, word: str, by: Sequence[float], feed: float) -> None:
        """Add a line by so many mm."""
        change = [round(NM * each) for each in by]
        self._add(word + _words(change), change, feed)

    def arc(self, plane: str, axes: tuple[int, int, int], letters: str, *, radius: float,
            angle: float, sweep: float, across: float, feed: float) -> None:
        """Add an arc from an angle; of 2 pi it is a full circle."""
        full = isclose(abs(sweep), 2 * pi)
        offset = [round(-NM * radius * f(angle)) for f in (cos, sin)]
        change = [0, 0, 0]
        if not full:
            for axis, f in zip(axes, (cos, sin), strict=False):
                change[axis] = round(NM * radius * (f(angle + sweep) - f(angle)))
        change[axes[2]] = round(NM * across)
        centre = [(self.at[axis] + by) / NM for axis, by in zip(axes, offset, strict=False)]
        text = (f"{plane}{'G3' if sweep > 0 else 'G2'}" + f"{'XYZ'[axes[0]]}0" * full
                + _words(change) + "".join(
                    f"{letter}{_mm(by)}" for letter, by in zip(letters, offset, strict=True)))
        self._add(text, change, feed, Arc(axes, (centre[0], centre[1]),
                                          hypot(*offset) / NM, angle, sweep))

    def _add(self, text: str, change: Sequence[int], feed: float, arc: Arc | None = None) -> None:
        end = tuple(at + by for at, by in zip(self.at, change, strict=True))
        if feed < inf:
            feed = round(60 * feed, 3) / 60
            text += f"F{60 * feed:.3f}"
        self.lines.append(text)
        self.pieces.append(Piece(self.at, end, feed, arc))
        self.at = end


def _step(place: Sequence[int], steps: Sequence[int]) -> list[int]:
    """Return the nearest step of each axis."""
    return [floor(Fraction(at * per_mm, NM) + Fraction(1, 2))
            for at, per_mm in zip(place, steps, strict=True)]


def _words(change: Sequence[int]) -> str:
    return "".join(f"{axis}{_mm(by)}" for axis, by in zip("XYZ", change, strict=True) if by)


def _mm(nanometres: int) -> str:
    return f"{nanometres / NM:.6f}"


def _feed(rng: random.Random) -> float:
    return 10 ** rng.uniform(1.3, 2.5)


def _lines(made: Program, rng: random.Random) -> None:
    """Lines of one, two or three axes, there and at times back again."""
    while len(made.lines) < 6:
        axes = rng.sample(range(3), rng.choice([1, 2, 3]))
        length = 10 ** rng.uniform(-0.2, 0.8)
        by = [length * rng.choice([-1, 1]) * rng.uniform(0.2, 1) * (axis in axes)
              for axis in range(3)]
        feed = rng.choice([inf, _feed(rng)])
        made.line("G1" if feed < inf else "G0", by, feed)
        if rng.random() < 0.3:
            made.line("G0", [-each for each in by], inf)


def _corners(made: Program, rng: random.Random) -> None:
    """Lines with corners of any angle between them."""
    angle, feed = rng.uniform(-pi, pi), _feed(rng)
    for _ in range(14):
        angle += rng.choice([rng.gauss(0, 0.2), rng.gauss(0, 1), rng.uniform(-pi, pi), pi / 2])
        length = 10 ** rng.uniform(-0.7, 0.5)
        rise = length * rng.choice([0, 0, rng.uniform(-0.5, 0.5)])
        word, own = rng.choice([("G0", inf), ("G1", feed)])
        made.line(word, [length * cos(angle), length * sin(angle), rise], own)


def _short(made: Program, rng: random.Random) -> None:
    """Short segments of a curve that gets narrower."""
    angle, feed = rng.uniform(-pi, pi), _feed(rng)
    length = rng.uniform(50, 150) / max(made.limits.steps)
    for number in range(60):
        angle += rng.gauss(0, 0.01 + number / 150)
        by = length * rng.uniform(0.5, 1.5)
        made.line("G1", [by * cos(angle), by * sin(angle), 0], feed)


def _arcs(made: Program, rng: random.Random) -> None:
    """Arcs, full circles and helices in all planes, with lines between them."""
    for _ in range(4):
        plane, axes, letters = rng.choice(PLANES)
        # From rest to the highest speed takes 0.87 rad, and a large arc is measured better.
        large = rng.random() < 0.5
        radius = 10 ** (rng.uniform(0.3, 0.7) if large else rng.uniform(-0.5, 0.1))
        sweep = rng.uniform(1.8, 3) if large else rng.choice([2 * pi, rng.uniform(0.5, 6)])
        sweep *= rng.choice([-1, 1])
        across = rng.choice([0, 0, rng.uniform(-1, 1) * radius])
        made.arc(plane, axes, letters, radius=radius, angle=rng.uniform(-pi, pi), sweep=sweep,
                 across=across, feed=10 ** rng.uniform(1.9, 2.5))
        if rng.random() < 0.5:
            axis, by = rng.randrange(3), rng.choice([-1, 1]) * rng.uniform(0.3, 2)
            made.line("G1", [by * (axis == each) for each in range(3)], _feed(rng))


KINDS: dict[str, Callable[[Program, random.Random], None]] = {
    "lines": _lines, "arcs": _arcs, "corners": _corners, "short": _short}


def program(kind: str, rng: random.Random) -> Program:
    """Make a random program of a kind, for a machine of which each axis is another."""
    steps = tuple(rng.choice(FINE_STEPS_PER_MM if kind == "arcs" else STEPS_PER_MM)
                  for _ in range(3))
    slowest = 0.6 if kind == "arcs" else 0.2
    rates = tuple(round(60 * min(FASTEST, MOST_RATE / each * rng.uniform(slowest, 0.98)), 3) / 60
                  for each in steps)
    highest = 3.7 if kind == "arcs" else 4.2
    accelerations = tuple(round(10 ** rng.uniform(3.3, highest), 3) for _ in range(3))
    made = Program(Limits(steps, rates, accelerations, round(10 ** rng.uniform(-1.5, -0.7), 3)),
                   ["G91G21"])
    KINDS[kind](made, rng)
    return made
