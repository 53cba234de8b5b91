"""The values of a signal over time, as arrays: a row per change."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["UNKNOWN", "Kind", "Trace", "Value", "collect", "each", "moments", "unlike"]

BLOCK = 4096
"""Rows converted at a time: arrays are small, Python's own numbers are not."""

Kind = Literal["bits", "signed", "real", "text", "event"]
"""How a signal is read. ``text`` has names for values, such as the states of an FSM."""

Value = int | float | str
"""A value. Names, and levels of bits of which one is not 0 or 1, are a `str`."""

UNKNOWN = "x"
"""The value of a signal before its first change."""


@dataclass(frozen=True)
class Trace:
    """The settled values of a signal.

    Of several changes at one time only the last is kept, and only if it changes the value.

    Attributes
    ----------
    times : array of int64, shape (n,)
        Times of its changes, in ticks of its wave; ascending.
    numbers : array, shape (n,)
        Values that are numbers: the smallest unsigned integers that hold them, Python's own beyond
        64 bits, or float64.
    codes : array of int32, shape (n,)
        Index of the value in `words`, or -1 where it is a number.
    words : list of str
        The values that are not numbers.
    kind : Kind
        How they are read.
    bits : int
        Width; 0 if it has none.
    """

    times: NDArray[np.int64]
    numbers: NDArray
    codes: NDArray[np.int32]
    words: list[str]
    kind: Kind
    bits: int

    def __len__(self) -> int:
        return len(self.times)

    @property
    def named(self) -> bool:
        """Whether its words are names, and not levels with unknown bits."""
        return self.kind in ("text", "event")

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """Rows in which a bit is neither 0 nor 1."""
        return np.zeros(len(self), bool) if self.named else self.codes >= 0

    def rows(self, times: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the row in force at each time, -1 before the first."""
        return np.searchsorted(self.times, times, side="right") - 1

    def value(self, row: int) -> Value:
        """Return the value of a row; before the first it is unknown."""
        if row < 0:
            return UNKNOWN
        if self.codes[row] >= 0:
            return self.words[self.codes[row]]
        value = self.numbers[row]
        return float(value) if self.kind == "real" else int(value)

    def at(self, time: int) -> Value:
        """Return the value at a time."""
        return self.value(int(np.searchsorted(self.times, time, side="right")) - 1)

    def edges(self, *, rising: bool) -> NDArray[np.int64]:
        """Return the times of changes of one bit from 0 to 1, or back. Unknown is neither."""
        before, after = (0, 1) if rising else (1, 0)
        known = self.codes < 0
        low, high = known & (self.numbers == before), known & (self.numbers == after)
        return self.times[1:][low[:-1] & high[1:]]


def collect(
    parts: Iterable[tuple[Sequence[int], Sequence[Value]]],
    length: int,
    *,
    kind: Kind,
    bits: int,
    names: dict[int, str] | None = None,
) -> Trace:
    """Make a trace of all changes of a signal.

    Parameters
    ----------
    parts : iterable of pairs of sequences
        Times and values, ascending, in blocks.
    length : int
        Number of changes.
    kind : Kind
        How values are read.
    bits : int
        Width.
    names : dict of int to str, optional
        Names of numbers.

    Raises
    ------
    OverflowError
        If a time has more than 63 bits.
    """
    table: dict[str, int] = {}
    times, numbers = np.empty(length, np.int64), np.zeros(length, _shape(kind, bits))
    codes = np.full(length, -1, np.int32)
    done = 0
    for new, values in parts:
        part = slice(done, done := done + len(new))
        times[part] = np.fromiter(new, np.int64, len(new))
        if str in set(map(type, values)):
            codes[part] = [table.setdefault(value, len(table)) if isinstance(value, str) else -1
                           for value in values]
            values = [0 if isinstance(value, str) else value for value in values]
        numbers[part] = values
    if names:
        _name(numbers, codes, names, table)
    settled = np.append(times[1:] != times[:-1], np.ones(min(length, 1), bool))
    if not settled.all():
        times, numbers, codes = times[settled], numbers[settled], codes[settled]
    new = np.ones(len(times), bool)
    if kind != "event":
        new[1:] = unlike(numbers[1:], numbers[:-1]) | (codes[1:] != codes[:-1])
    if not new.all():
        times, numbers, codes = times[new], numbers[new], codes[new]
    return Trace(times, numbers, codes, list(table), kind, bits)


def unlike(one: NDArray, other: NDArray) -> NDArray[np.bool_]:
    """Return where two arrays of values differ. NaN equals NaN."""
    differs = np.asarray(one != other, bool)
    if one.dtype.kind == other.dtype.kind == "f":
        differs &= ~(np.isnan(one) & np.isnan(other))
    return differs


def moments(
    traces: Sequence[Trace], start: int, end: int, scale: Sequence[int] | None = None
) -> Iterator[NDArray[np.int64]]:
    """Yield the times at which any of the traces changes, each once and ascending, in blocks.

    Parameters
    ----------
    traces : sequence of Trace
        The traces.
    start, end : int
        The first time, and the last possible one.
    scale : sequence of int, optional
        Factors by which the times of each trace are multiplied.
    """
    scale = [1] * len(traces) if scale is None else scale
    places = [int(np.searchsorted(trace.times, start // factor, side="right"))
              for trace, factor in zip(traces, scale, strict=True)]
    some = np.array([start], np.int64)
    while len(some):
        yield some
        parts = [trace.times[place:place + BLOCK] * factor
                 for trace, place, factor in zip(traces, places, scale, strict=True)]
        # Its trace may have more beyond the last row of a full block.
        until = min([end, *(int(part[-1]) for part in parts if len(part) == BLOCK)])
        parts = [part[part <= until] for part in parts]
        places = [place + len(part) for place, part in zip(places, parts, strict=True)]
        some = np.unique(np.concatenate(parts))


def each(*columns: NDArray) -> Iterator[tuple]:
    """Yield the rows of arrays of equal length as Python's own values."""
    for start in range(0, len(columns[0]), BLOCK):
        yield from zip(*(column[start:start + BLOCK].tolist() for column in columns), strict=True)


def _shape(kind: Kind, bits: int) -> type:
    """Return the values with the smallest integer type that holds them: there may be millions."""
    if kind == "real":
        return np.float64
    return next((shape for shape in (np.uint8, np.uint16, np.uint32, np.uint64)
                 if bits <= np.iinfo(shape).bits), object)


def _name(numbers: NDArray, codes: NDArray, names: dict[int, str], table: dict[str, int]) -> None:
    """Replace numbers that have a name by it."""
    for number in np.unique(numbers[codes < 0]).tolist():
        if number in names:
            rows = (numbers == number) & (codes < 0)
            codes[rows] = table.setdefault(names[number], len(table))
            numbers[rows] = 0
