"""The signals of a condition: their values at given times, and which bits are known."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .names import one
from .radix import Radixes
from .reader import Wave
from .trace import Trace

__all__ = ["Column", "Source"]


@dataclass(frozen=True)
class Column:
    """An operand of a condition at some times.

    Attributes
    ----------
    kind : str
        Its type.
    values : array
        A value per time, or a single one.
    known : array of bool
        Whether each is known.
    unsure : array, optional
        Of bit vectors, a mask of the unknown bits.
    """

    kind: Literal["number", "text", "truth", "event"]
    values: NDArray
    known: NDArray[np.bool_]
    unsure: NDArray | None = None


@dataclass(frozen=True)
class Source:
    """A signal of a condition, prepared once.

    Attributes
    ----------
    trace : Trace
        Its values.
    signed : bool
        Whether it is a signed number.
    words : array
        One entry for each word of the trace, one for an unseen value, one for no word: a name, or
        the two numbers of `_word_bits`.
    """

    trace: Trace
    signed: bool
    words: NDArray

    @classmethod
    def of(cls, wave: Wave, radixes: Radixes, name: str) -> "Source":
        """Find the signal of that name."""
        signal = one(wave, name)
        trace = wave.trace(signal)
        bits = 0 if trace.named or trace.kind == "real" else trace.bits
        if trace.named:
            words = np.array([*trace.words, "", ""], object)
        else:
            # Before the first change all bits are unknown; a number has no unknown bit.
            words = np.array([_word_bits(word) for word in (*trace.words, "x" * bits, "")],
                             np.uint64 if bits <= 64 else object)
        return cls(trace, bits <= 64 and radixes.of(signal) == "signed", words)

    def column(self, times: NDArray[np.int64]) -> Column:
        """Return the operand at these times."""
        trace, words = self.trace, self.words
        if not len(trace):
            return Column("number", np.zeros(len(times), np.uint64),
                           np.zeros(len(times), bool))
        rows = trace.rows(times)
        seen = rows >= 0
        if trace.kind == "event":
            return Column("event", seen & (trace.times[rows] == times),
                           np.ones(len(rows), bool))
        codes = np.where(seen, trace.codes[rows], len(trace.words))
        numbers = trace.numbers[rows]
        if trace.kind == "text":
            return Column("text", np.where(codes < 0, numbers.astype(object), words[codes]), seen)
        if trace.kind == "real":
            return Column("number", numbers, codes < 0)
        ones, unsure = (_extended(some, trace.bits, self.signed) for some in (
            np.where(codes < 0, numbers, words[codes, 0]), words[codes, 1]))
        return Column("number", ones, codes < 0, unsure)


def _extended(values: NDArray, bits: int, signed: bool) -> NDArray:
    """Widen values to 64 bits; Python's own integers are unchanged."""
    if values.dtype == object:
        return values
    values = values.astype(np.uint64)
    if not signed:
        return values
    # Shifting the sign to bit 63 and back extends it.
    shift = np.int64(64 - bits)
    return values.view(np.int64) << shift >> shift


def _word_bits(word: str) -> tuple[int, int]:
    """Return a word of levels as two masks: bits that are 1, and bits that are unknown."""
    return (int("0" + "".join("01"[level == "1"] for level in word), 2),
            int("0" + "".join("01"[level not in "01"] for level in word), 2))
