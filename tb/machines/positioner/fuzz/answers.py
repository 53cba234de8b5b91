"""The answers of `positioner` to lines: each in its turn, or one that stands for many.

How many wait is known by what has been sent. Where it is not known to the clock, because the line
was still busy with the byte before, all that may be is followed.
"""

from bisect import bisect_right
from collections.abc import Sequence

from tb.fuzz.trajectory import Failure

__all__ = ["STATE", "Answers", "Due"]

NAMED = 31
"""Answers that wait by name behind the one that is next; the place behind them is for OVERFLOW."""

OVERFLOW = b"! OVERFLOW\n"
STATE = b"STATE"
"""What the answer to STATE begins with; what is behind it is no matter here."""

LONGEST, REPORT, LONGEST_STATE = 18, 50, 86
"""Bytes of the longest answer, report and state, each with some time to begin."""

MARGIN = 12
"""Clocks, besides a byte, from the answer that is taken to its first bit."""


class Due:
    """When an answer begins at the latest that waits when another begins, or the line is quiet.

    It waits for the end of that, for a report, and for one to come, which it would delay; a state
    for the next tick, in whose time no other answer begins.

    Parameters
    ----------
    byte, report : int
        Clocks of a byte, and from report to report.
    """

    def __init__(self, byte: int, report: int) -> None:
        self._byte, self._report = byte, report

    def __call__(self, begin: int, text: bytes = b"") -> int:
        at = begin + LONGEST * self._byte
        if text.startswith(STATE):
            return (at // self._report + 1) * self._report + MARGIN
        tick = (at + LONGEST * self._byte) // self._report * self._report
        return max(at, tick + REPORT * self._byte) if tick else at

    def after(self, begin: int, text: bytes) -> int:
        """Return where an answer would have begun that ends with this one, or later."""
        return begin + (LONGEST_STATE - LONGEST) * self._byte * text.startswith(STATE)


class Answers:
    """Holds answers against lines that are to have one.

    Parameters
    ----------
    answers : sequence of pairs
        All answers with the clock in which each begins, those that tell of switches among them.
    due : Due
        Gives the clock by which an answer begins that waits since a clock.
    byte, clocks : int
        Clocks of a byte; clocks in all.

    Attributes
    ----------
    count : int
        Answers to lines.
    """

    def __init__(self, answers: Sequence[tuple[int, bytes]], due: Due, byte: int,
                 clocks: int) -> None:
        before = [(-1, b""), *answers]
        #: Each with the answer before it, and the clock in which that begins.
        self._answers = [(*each, clock, text) for each, (clock, text) in
                         zip(before, answers, strict=False) if not text.startswith(b"! LIMIT")]
        self._latest, self._clocks, self._last = due, clocks, before[-1]
        self._byte = byte
        # When each has left the queue: it makes room when the one before it is taken.
        self._late = [begin for begin, *_ in self._answers]
        self._early = [begin - byte - MARGIN for begin in self._late]
        self._queued = {0}  # numbers of answers that may have been queued so far
        self.count = len(self._answers)

    def answer(self, line: bytes, text: bytes, earliest: int, latest: int) -> Failure | None:
        """Look for the answer to a line, due from some time between two clocks."""
        least_gone = bisect_right(self._late, earliest)
        most_gone = bisect_right(self._early, latest)
        queued = set()
        for count in self._queued:
            least, most = count - min(count, most_gone), count - min(count, least_gone)
            if (least < NAMED and self._is(count, text, earliest)
                    or least <= NAMED <= most and self._is(count, OVERFLOW, earliest)):
                queued.add(count + 1)
            if most > NAMED:
                queued.add(count)
        if queued:
            self._queued = queued
            return None
        count = min(self._queued)
        *_, clock, given = self._answers[count] if count < self.count else (self._clocks, b"")
        return Failure(min(clock, self._due(count, text, earliest)), "answer",
                       f"line {line[:40]!r} is answered by {given!r}, not {text!r}")

    def rest(self) -> Failure | None:
        """Return what is answered to no line, when all lines are through."""
        if (count := max(self._queued)) < self.count:
            *_, clock, text = self._answers[count]
            return Failure(clock, "answer", f"an answer to no line: {text!r}")
        return None

    def _is(self, number: int, text: bytes, earliest: int) -> bool:
        """Return whether an answer is that, and comes in time; or still waits."""
        due = self._due(number, text, earliest)
        if number >= self.count:
            # One that has begun and is cut off by the end is none that was said.
            return number > self.count or due + len(text) * self._byte > self._clocks
        *_, clock, given = self._answers[number]
        same = given.startswith(STATE) if text == STATE else given == text
        return same and earliest < clock <= due

    def _due(self, number: int, text: bytes, earliest: int) -> int:
        before = self._answers[number][:2] if number < self.count else self._last
        return self._latest(max(earliest, self._latest.after(*before)), text)
