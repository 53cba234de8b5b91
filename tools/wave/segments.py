"""A trace reduced to pixels: few segments, whatever the number of changes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .trace import Trace, Value

__all__ = ["Segment", "extent", "segments"]

NARROW = 1.5
"""Distance in pixels below which two changes are drawn as one busy segment."""


@dataclass(frozen=True)
class Segment:
    """A value over an interval of pixels, or many values that are too short to be shown.

    Attributes
    ----------
    left, right : float
        Its ends in pixels.
    value : Value
        The value; the last of many.
    busy : bool
        Whether there are many.
    cut_left, cut_right : bool
        Whether it continues beyond the picture.
    numbers : array
        The numbers in it, if all are known.
    """

    left: float
    right: float
    value: Value
    busy: bool
    cut_left: bool
    cut_right: bool
    numbers: NDArray

    @property
    def width(self) -> float:
        """Its width in pixels."""
        return self.right - self.left

    def extremes(self, signed: int) -> Sequence[float] | None:
        """Return its minimum, maximum and last number, or its only one; None if one is unknown."""
        numbers = _finite(self.numbers, signed)
        if not len(numbers):
            return None
        if len(numbers) == 1:
            return [float(numbers[0])]
        return [float(numbers.min()), float(numbers.max()), float(numbers[-1])]


def segments(
    trace: Trace, start: int, end: int, left: float, right: float, *, fine: bool = False
) -> list[Segment]:
    """Reduce a trace to segments.

    Parameters
    ----------
    trace : Trace
        The trace.
    start, end : int
        The interval, in ticks; the end is not before the start.
    left, right : float
        The places of these, in pixels.
    fine : bool
        Whether busy segments are split into narrow ones, for a curve.

    Returns
    -------
    list of Segment
        From left to right without gaps, at most about two per pixel.
    """
    first, last = int(trace.rows(np.array([start]))[0]), int(trace.rows(np.array([end]))[0])
    if last > first and trace.times[last] == end:
        last -= 1
    rows = np.arange(first, last + 1)
    times = np.append(np.maximum(trace.times[rows[rows >= 0]], start), end)
    if first < 0:
        times = np.insert(times, 0, start)
    places = left + (times - start) * ((right - left) / (end - start))
    narrow = np.diff(places) < NARROW
    # A new segment begins unless this one and the one before are both narrow.
    apart = ~(narrow[1:] & narrow[:-1])
    if fine:
        apart |= np.diff(places[:-1] // NARROW) > 0
    begins = np.flatnonzero(np.append([True], apart))
    found = []
    for begin, until in zip(begins.tolist(), [*begins[1:].tolist(), len(rows)], strict=True):
        held = rows[begin:until]
        known = held[0] >= 0 and not (trace.codes[held] >= 0).any()
        numbers = trace.numbers[held] if known else trace.numbers[:0]
        found.append(Segment(
            float(places[begin]), float(places[until]), trace.value(int(held[-1])), len(held) > 1,
            begin == 0 and (first < 0 or bool(trace.times[first] < start)),
            until == len(rows), numbers))
    return found


def extent(trace: Trace, start: int, end: int, signed: int) -> tuple[float, float]:
    """Return the minimum and maximum of 0 and all known numbers in this interval."""
    first, last = trace.rows(np.array([start, end]))
    rows = np.arange(max(int(first), 0), int(last) + 1)
    numbers = _finite(trace.numbers[rows[trace.codes[rows] < 0]], signed)
    return float(numbers.min(initial=0)), float(numbers.max(initial=0))


def _finite(numbers: NDArray, signed: int) -> NDArray[np.float64]:
    numbers = _signed(numbers, signed).astype(float)
    return numbers[np.isfinite(numbers)]


def _signed(numbers: NDArray, bits: int) -> NDArray:
    """Reinterpret numbers of so many bits as signed; with 0 bits return them unchanged."""
    if not bits:
        return numbers
    wide = numbers.astype(object) if bits > 63 else numbers.astype(np.int64)
    return np.where(wide >= 1 << bits - 1, wide - (1 << bits), wide)
