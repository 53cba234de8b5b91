"""Times as text: 12us, 1.5ms, 300clk."""

import re
from bisect import bisect_right
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..console import UserError
from . import names
from .reader import Signal, Wave

__all__ = ["UNITS", "Timeline"]

UNITS = {"s": 0, "ms": -3, "us": -6, "ns": -9, "ps": -12, "fs": -15}
"""Powers of ten, in seconds, the largest unit first."""

_TIME = re.compile(r"(\d{1,30}(?:\.\d{1,30})?)\s*([a-zµ]+)")


class Timeline:
    """The times of a wave, and its clock.

    Clock n is the n-th rising edge: the first is clock 1, and the time before it is clock 0.

    Parameters
    ----------
    wave : Wave
        The wave.
    clock : str, optional
        Name of its clock. The default is the signal ``clk`` or ``clock`` in the highest scope, or
        else the bit that changes most.
    """

    def __init__(self, wave: Wave, clock: str | None = None) -> None:
        self.wave = wave
        self._name = clock

    @cached_property
    def clock(self) -> Signal | None:
        """The clock, if there is one."""
        if self._name is not None:
            clock = names.one(self.wave, self._name)
            if clock.bits != 1:
                raise UserError(f"{clock.path} has {clock.bits} bits: a clock has one")
            return clock
        bits = [signal for signal in self.wave.signals if signal.bits == 1]
        named = [signal for signal in bits if signal.name.lower() in ("clk", "clock")]
        if named:
            least = min(len(signal.parts) for signal in named)
            return max((signal for signal in named if len(signal.parts) == least),
                       key=self.wave.changes)
        return max(bits, key=self.wave.changes, default=None)

    @cached_property
    def rises(self) -> NDArray[np.int64]:
        """The rising edges of the clock, in ticks."""
        if self.clock is None:
            return np.zeros(0, np.int64)
        return self.wave.trace(self.clock).edges(rising=True)

    @cached_property
    def period(self) -> float | None:
        """The median time from one rising edge to the next in ticks, if there are two."""
        return float(np.median(np.diff(self.rises))) if len(self.rises) > 1 else None

    def clocks(self, time: int | NDArray[np.int64]) -> NDArray[np.int64]:
        """Count the rising edges up to one time or several, inclusive."""
        return np.searchsorted(self.rises, time, side="right")

    def ticks(self, text: str) -> Fraction:
        """Parse a time. The result need not be a whole number of ticks.

        Raises
        ------
        UserError
            If it is not a time, or a clock that is not in the wave.
        """
        read = _TIME.fullmatch(text.strip())
        if text.strip() == "0":
            return Fraction(0)
        if read is None or read[2] not in (*UNITS, "µs", "clk"):
            raise UserError(f"a time is written 12us, 1.5ms or 300clk, not {text[:40]!r}")
        number = Fraction(read[1])
        if read[2] != "clk":
            exponent = UNITS[read[2].replace("µ", "u")]
            return number * Fraction(10) ** exponent / self.wave.tick
        if number.denominator != 1:
            raise UserError(f"clocks are whole numbers, not {text!r}")
        if number == 0:
            return Fraction(0)
        if number > len(self.rises):
            name = "there is no clock" if self.clock is None else (
                f"the clock {self.clock.path} rises {len(self.rises)} times")
            raise UserError(f"{text}: {name}; --clock names another")
        return Fraction(int(self.rises[int(number) - 1]))

    def window(self, start: str | None, end: str | None) -> tuple[int, int]:
        """Parse the ends of an interval; the default is the whole wave.

        Raises
        ------
        UserError
            If they are not times, or the end is before the start.
        """
        first, last = self.wave.span
        low = first if start is None else self._least(start)
        high = last if end is None else self.ticks(end).__floor__()
        if high < low:
            raise UserError(f"nothing is between {self.text(low)} and {self.text(high)}: "
                            f"{self.wave.path} goes from {self.text(first)} to {self.text(last)}")
        # A time far beyond the wave is replaced by its end, which fits into an array.
        return low, min(high, max(last, low))

    def _least(self, start: str) -> int:
        low = self.ticks(start).__ceil__()
        if low > self.wave.span[1]:
            raise UserError(f"--from {start} is after the end of {self.wave.path}, "
                            f"which is {self.text(self.wave.span[1])}")
        return low

    def text(self, ticks: float | Fraction) -> str:
        """Format a time exactly, in the largest unit of which there is at least one.

        A `float`, such as a mean, gets four digits.
        """
        seconds = Fraction(ticks) * self.wave.tick
        exact = not isinstance(ticks, float)
        if not seconds:
            return "0"
        sizes = [Fraction(10) ** exponent for exponent in UNITS.values()]
        # Descending units: the first that is not larger than the time.
        place = next((n for n, size in enumerate(sizes) if size <= abs(seconds)), len(sizes) - 1)
        number = seconds / sizes[place]
        return f"{_decimal(number) if exact else f'{float(number):.4g}'}{list(UNITS)[place]}"

    def text_with_clock(self, ticks: int) -> str:
        """Format a time, and its clock if there is one."""
        clock = f" ({bisect_right(self.rises, ticks)}clk)" if len(self.rises) else ""
        return self.text(ticks) + clock


def _decimal(number: Fraction) -> str:
    """Write all digits of a number whose denominator has no prime factors but 2 and 5."""
    digits = 0
    while number.denominator != 1 and digits < 30:
        number, digits = number * 10, digits + 1
    text = str(round(number)).zfill(digits + 1)
    return f"{text[:-digits]}.{text[-digits:]}" if digits else text
