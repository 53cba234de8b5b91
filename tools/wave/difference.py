"""Where the values of two signals differ: first time, number of intervals, total duration."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .pairing import Pair
from .trace import Trace, Value, moments, unlike

__all__ = ["Difference", "compared"]


@dataclass(frozen=True)
class Difference:
    """Differences of a pair of signals.

    Attributes
    ----------
    pair : Pair
        The signal of each wave.
    first : int
        The first time at which they differ, in ticks of the first wave.
    values : tuple of Value
        Their values then.
    intervals : int
        Number of intervals in which they differ.
    ticks : int
        Total length of these intervals, in common ticks.
    """

    pair: Pair
    first: int
    values: tuple[Value, Value]
    intervals: int
    ticks: int


def compared(
    pair: Pair, traces: tuple[Trace, Trace], scale: tuple[int, int], low: int, high: int
) -> Difference | None:
    """Compare two traces.

    Parameters
    ----------
    pair, traces : pairs of Signal and Trace
        The two signals, and their values.
    scale : pair of int
        Common ticks in a tick of each.
    low, high : int
        The span to compare, in common ticks; the value at `high` is compared as well.

    Returns
    -------
    Difference or None
        None if they agree.
    """
    codes = _common_codes(traces)
    first: int | None = None
    values: tuple[Value, Value] = ("", "")
    intervals = ticks = since = 0
    differed = False
    for times in moments(traces, low, high, scale):
        rows = [trace.rows(times // factor) for trace, factor in zip(traces, scale, strict=True)]
        differs = _differs(traces, codes, rows)
        if differed:
            ticks += int(times[0]) - since
        ticks += int(np.diff(times)[differs[:-1]].sum())
        intervals += int(np.count_nonzero(differs & ~np.append(differed, differs[:-1])))
        if first is None and differs.any():
            place = int(np.argmax(differs))
            first = int(times[place])
            one, two = (trace.value(int(row[place]))
                        for trace, row in zip(traces, rows, strict=True))
            values = one, two
        since, differed = int(times[-1]), bool(differs[-1])
    if first is None:
        return None
    return Difference(pair, first, values, intervals, ticks + differed * (high - since))


def _common_codes(traces: tuple[Trace, Trace]) -> list[NDArray[np.int64]]:
    """Number the words of two traces alike; append the codes of no word and of unknown."""
    table: dict[str, int] = {}
    # All bits unknown is one word, whether written X, U or -.
    codes = [[table.setdefault("x" if not trace.named and not set(word) & set("01hl") else word,
                               len(table)) for word in trace.words] for trace in traces]
    unknown = table.setdefault("x", len(table))
    return [np.array([*some, -1, unknown], np.int64) for some in codes]


def _differs(
    traces: tuple[Trace, Trace], codes: Sequence[NDArray], rows: Sequence[NDArray]
) -> NDArray[np.bool_]:
    """Return in which rows two traces differ. The value before the first row is unknown."""
    words, numbers = [], []
    for trace, common, row in zip(traces, codes, rows, strict=True):
        if not len(trace):
            words.append(np.full(len(row), common[-1]))
            numbers.append(np.zeros(len(row), np.uint64))
            continue
        own = trace.codes[row]
        # -1 gets the last but one, which stands for no word.
        words.append(np.where(row < 0, common[-1], common[np.where(own < 0, len(common) - 2, own)]))
        number = trace.numbers[row]
        numbers.append(number.astype(np.uint64) if number.dtype.kind == "u" else number)
    return (words[0] != words[1]) | (
        (words[0] < 0) & (words[1] < 0) & unlike(numbers[0], numbers[1]))
