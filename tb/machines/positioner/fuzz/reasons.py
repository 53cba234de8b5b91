"""The reasons why `positioner` refuses lines: each said in its turn, or one that stands for many.

How many wait is known by what has been said. Where it is not known to the clock, because the line
was still busy with the byte before, all that may be is followed.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence

from tb.fuzz.trajectory import Failure

__all__ = ["Reasons", "due"]

NAMED = 31
"""Answers that wait by name behind the one that is next; the place behind them is for OVERFLOW."""

OVERFLOW = b"! OVERFLOW\n"

LONGEST, REPORT = 18, 50
"""Bytes of the longest answer and of the longest report, each with some time to begin."""

MARGIN = 12
"""Clocks, besides a byte, from the answer that is taken to its first bit."""


def due(begin: int, byte: int, report: int) -> int:
    """Return the latest begin of an answer that waits when another begins, or the line is quiet.

    It waits for the end of that, for a report, and for one to come, which it would delay. Bytes,
    and the time between reports, are in clocks.
    """
    at = begin + LONGEST * byte
    tick = (at + LONGEST * byte) // report * report
    return max(at, tick + REPORT * byte) if tick else at


class Reasons:
    """Holds answers against lines that are refused.

    Parameters
    ----------
    answers : sequence of pairs
        All answers with the clock in which each begins, those that tell of switches among them.
    due : callable
        Gives the clock by which an answer begins that waits since a clock.
    byte, clocks : int
        Clocks of a byte; clocks in all.

    Attributes
    ----------
    count : int
        Reasons that were said.
    """

    def __init__(self, answers: Sequence[tuple[int, bytes]], due: Callable[[int], int], byte: int,
                 clocks: int) -> None:
        before = [-1, *(clock for clock, _ in answers)]
        #: Each with the clock in which the answer before it begins.
        self._answers = [(begin, clock, text) for begin, (clock, text) in
                      zip(before, answers, strict=False) if not text.startswith(b"! LIMIT")]
        self._latest, self._clocks, self._last = due, clocks, before[-1]
        self._byte = byte
        # When each has left the queue: it makes room when the one before it is taken.
        self._late = [begin for begin, *_ in self._answers]
        self._early = [begin - byte - MARGIN for begin in self._late]
        self._queued = {0}  # numbers of reasons that may have been queued so far
        self.count = len(self._answers)

    def refuse(self, line: bytes, wrong: str, earliest: int, latest: int) -> Failure | None:
        """Look at the answer to a line, refused some time between two clocks."""
        name = b"! %s\n" % wrong.encode()
        least_gone = bisect_right(self._late, earliest)
        most_gone = bisect_right(self._early, latest)
        queued = set()
        for count in self._queued:
            least, most = count - min(count, most_gone), count - min(count, least_gone)
            if (least < NAMED and self._is(count, name, earliest)
                    or least <= NAMED <= most and self._is(count, OVERFLOW, earliest)):
                queued.add(count + 1)
            if most > NAMED:
                queued.add(count)
        if queued:
            self._queued = queued
            return None
        count = min(self._queued)
        _, clock, text = self._answers[count] if count < self.count else (0, self._clocks, b"")
        return Failure(min(clock, self._due(count, earliest)), "answer",
                       f"line {line[:40]!r} is answered by {text!r}, not {wrong}")

    def rest(self) -> Failure | None:
        """Return what is answered to no line, when all lines are through."""
        if (count := max(self._queued)) < self.count:
            _, clock, text = self._answers[count]
            return Failure(clock, "answer", f"an answer to no line: {text!r}")
        return None

    def _is(self, number: int, text: bytes, earliest: int) -> bool:
        """Return whether a reason is that, and comes in time; or still waits."""
        due = self._due(number, earliest)
        if number >= self.count:
            # One that has begun and is cut off by the end is none that was said.
            return number > self.count or due + len(text) * self._byte > self._clocks
        _, clock, text_given = self._answers[number]
        return text_given == text and earliest < clock <= due

    def _due(self, number: int, earliest: int) -> int:
        before = self._answers[number][0] if number < self.count else self._last
        return self._latest(max(earliest, before))
