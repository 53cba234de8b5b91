"""Curves in the plane, kept exact until the scale of the drawing is known.

Points are complex numbers: x + jy. Transforms are affine, which a Bézier curve and an ellipse both
survive, so that nothing is flattened before it has its size on the wall.
"""

from math import ceil, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Affine", "Cubic", "Curve", "Ellipse", "Polyline", "Straight"]

Polyline = NDArray[np.complex128]

MOST_CHORDS = 1 << 16
"""Of one curve: a curve that fits a wall needs far less."""


class Affine(NamedTuple):
    """An affine transform: where the unit vectors lead, and where the origin goes."""

    x: complex = 1
    y: complex = 1j
    origin: complex = 0

    def vector(self, vector: complex) -> complex:
        """Return the image of a vector."""
        return vector.real * self.x + vector.imag * self.y

    def __call__(self, point: complex) -> complex:
        return self.vector(point) + self.origin

    def after(self, inner: "Affine") -> "Affine":
        """Return this one after another: what nesting of groups means."""
        return Affine(self.vector(inner.x), self.vector(inner.y), self(inner.origin))

    @property
    def determinant(self) -> float:
        """By how much an area grows; 0 if all falls on a line."""
        return (self.x.conjugate() * self.y).imag

    def inverse(self) -> "Affine":
        """Return what undoes it, unless all falls on a line."""
        back = Affine(complex(self.y.imag, -self.x.imag) / self.determinant,
                      complex(-self.y.real, self.x.real) / self.determinant)
        return back._replace(origin=-back(self.origin))


class Straight(NamedTuple):
    """A line."""

    start: complex
    end: complex

    def moved(self, affine: Affine) -> "Straight":
        """Return its image."""
        return Straight(*map(affine, self))

    def bounds(self) -> Polyline:
        """Return points of it whose bounding box is its own."""
        return np.array(self)

    def chords(self, tolerance: float) -> Polyline:
        """Return points of it, from its start to its end, whose chords are so close to it."""
        return np.array(self)


class Cubic(NamedTuple):
    """A Bézier curve of degree three."""

    start: complex
    first: complex
    second: complex
    end: complex

    @classmethod
    def quadratic(cls, start: complex, control: complex, end: complex) -> "Cubic":
        """Return a curve of degree two as one of degree three: it is the same."""
        return cls(start, start + (control - start) * 2 / 3, end + (control - end) * 2 / 3, end)

    def moved(self, affine: Affine) -> "Cubic":
        """Return its image."""
        return Cubic(*map(affine, self))

    def at(self, t: NDArray) -> Polyline:
        """Return points at parameters from 0 to 1."""
        s = 1 - t
        return (s**3 * self.start + 3 * s * s * t * self.first + 3 * s * t * t * self.second
                + t**3 * self.end)

    def bounds(self) -> Polyline:
        """Return points of it whose bounding box is its own: ends, and where x or y turns."""
        a, b, c = (self.first - self.start, self.second - self.first, self.end - self.second)
        derivative = (a - 2 * b + c, 2 * (b - a), a)
        turns = [t.real for part in ("real", "imag")
                 for t in _roots(*(getattr(each, part) for each in derivative)) if 0 < t.real < 1]
        return np.concatenate([[self.start, self.end], self.at(np.array(turns))])

    def chords(self, tolerance: float) -> Polyline:
        """Return points of it, from its start to its end, whose chords are so close to it.

        A chord over a parameter step h is off by at most h²/8 of the second derivative, which is
        largest at an end of the curve.
        """
        most = 6 * max(abs(self.start - 2 * self.first + self.second),
                       abs(self.first - 2 * self.second + self.end))
        return _exact(self.at(_steps(sqrt(most / 8 / tolerance))), self.start, self.end)


class Ellipse(NamedTuple):
    """A part of an ellipse: ``centre + u cos t + v sin t``, t from `begin` on by `sweep`."""

    centre: complex
    u: complex
    v: complex
    begin: float
    sweep: float

    def moved(self, affine: Affine) -> "Ellipse":
        """Return its image."""
        return Ellipse(affine(self.centre), affine.vector(self.u), affine.vector(self.v),
                       self.begin, self.sweep)

    def at(self, t: NDArray) -> Polyline:
        """Return points at parameters from 0 to 1."""
        angle = self.begin + t * self.sweep
        return self.centre + self.u * np.cos(angle) + self.v * np.sin(angle)

    @property
    def start(self) -> complex:
        """Where it begins."""
        return complex(self.at(np.zeros(1))[0])

    @property
    def end(self) -> complex:
        """Where it ends."""
        return complex(self.at(np.ones(1))[0])

    def corners(self) -> tuple[complex, complex, complex, complex]:
        """Return the corners of a parallelogram around it, which are moved as it is."""
        side, other = self.u + self.v, self.u - self.v
        return self.centre + side, self.centre - side, self.centre + other, self.centre - other

    def bounds(self) -> Polyline:
        """Return points of it whose bounding box is its own: ends, and where x or y turns."""
        turns = np.array([np.arctan2(self.v.real, self.u.real),
                          np.arctan2(self.v.imag, self.u.imag)])
        turns = np.concatenate([turns, turns + pi])
        part = ((turns - self.begin) * np.sign(self.sweep)) % (2 * pi) / max(abs(self.sweep), 1e-12)
        return self.at(np.concatenate([[0, 1], part[part < 1]]))

    def chords(self, tolerance: float) -> Polyline:
        """Return points of it, from its start to its end, whose chords are so close to it.

        The second derivative is as long as the radius vector, at most the longer semi-axis.
        """
        longest = (abs(self.u - 1j * self.v) + abs(self.u + 1j * self.v)) / 2
        return self.at(_steps(abs(self.sweep) * sqrt(longest / 8 / tolerance)))


Curve = Straight | Cubic | Ellipse


def _steps(count: float) -> NDArray:
    return np.linspace(0, 1, min(max(1, ceil(count)), MOST_CHORDS) + 1)


def _exact(points: Polyline, start: complex, end: complex) -> Polyline:
    points[0], points[-1] = start, end
    return points


def _roots(a: float, b: float, c: float) -> list[complex]:
    """Return the roots of a x² + b x + c, however small a is."""
    if not (scale := max(abs(a), abs(b), abs(c))):
        return []
    return np.roots([each if abs(each) > 1e-12 * scale else 0.0 for each in (a, b, c)]).tolist()
