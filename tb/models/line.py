"""Model of the formulas of a line: what they stand for, in exact numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt

__all__ = ["BEYOND", "ONE", "Bounds", "Path", "junction", "place", "root"]

ONE = 1 << 34
"""A component of a direction that has the length 1."""

BEYOND = (1 << 62) - 1
"""Squared speeds end here."""


def root(value: Fraction | int) -> Fraction:
    """Return the square root, with a relative error below 2**-100."""
    value = Fraction(value)
    shift = 2 * max(0, 128 + value.denominator.bit_length() - value.numerator.bit_length())
    return Fraction(isqrt((value.numerator << shift) // value.denominator), 1 << shift // 2)


def place(position: int, steps: int) -> int:
    """Return a position in nm as so many 2**-8 of a step, rounded down, of so many per metre."""
    return position * steps * 256 // 10**9


@dataclass
class Bounds:
    """Within what limits a number may be."""

    low: Fraction
    high: Fraction

    def __contains__(self, value: int) -> bool:
        return self.low <= value <= self.high


class Path:
    """A line from one position to another, in nm, which differ."""

    def __init__(self, start: Sequence[int], end: Sequence[int]) -> None:
        self.distances = [to - at for at, to in zip(start, end, strict=True)]
        self.length = root(sum(each * each for each in self.distances))

    def unit(self) -> list[Fraction]:
        """Return the direction, of length `ONE`."""
        return [ONE * each / self.length for each in self.distances]

    def along(self, limits: Sequence[int], *, short: int = 0) -> Fraction:
        """Return the highest speed, or acceleration, along it, by limits of the axes less `short`.

        One that does not move has no limit.
        """
        return min((limit - short) * self.length / abs(each)
                   for limit, each in zip(limits, self.distances, strict=True) if each)

    def speed(self, feed: int, limits: Sequence[int], clock: int, *, short: int = 0) -> Fraction:
        """Return the top speed: it takes 128 clocks at least, and is below 2**31 nm/s."""
        return min(Fraction(feed), self.along(limits, short=short), self.length * clock / 128,
                   Fraction((1 << 31) - 1))


def junction(unit: Sequence[int], before: Sequence[int], limits: Sequence[int], deviation: int, *,
             error: Fraction | int = 0) -> Fraction:
    """Return the squared speed of a junction, `BEYOND` at most; `error` is added to its root."""
    turn = [abs(a - b) for a, b in zip(unit, before, strict=True)]
    square = Fraction(sum(each * each for each in turn), ONE**2)
    if not square:
        return Fraction(BEYOND)
    acceleration = min(limit * root(square) * ONE / each
                       for limit, each in zip(limits, turn, strict=True) if each)
    cosine = max(0, root(max(0, 1 - square / 4)) + error)
    return min(acceleration * deviation * 4 * cosine * (1 + cosine) / square, Fraction(BEYOND))
