"""`positioner` at the level of lines: what each is answered, where the motors may go."""

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from functools import partial

from tb.fuzz.trajectory import Failure
from tb.uart import Text

from .axes import Axis
from .limits import check_limit_reports
from .lines import AXES, BREAK, Line, refusal
from .reasons import Reasons, due

__all__ = ["LineSession"]

REPORT = re.compile(rb"# POS (-?\d+) (-?\d+) (-?\d+) :\n")
ANSWER = re.compile(rb"! (?:[A-Z]+|LIMIT MOT[123])\n")
LATENCY = 40
"""Clocks, besides one a byte, from the end of a line to what it does."""

AT_ONCE = 3
"""Clocks from a break to what it does."""

REPORT_DELAY = 4
"""Clocks from a multiple of the time between reports, from power-up, to the first bit of one."""


class LineSession:
    """What lines ask for, and what was said.

    Parameters
    ----------
    output : Text
        What the machine said.
    axes : sequence of Axis
        What its axes did.
    byte, report : int
        Clocks of a byte, and from report to report.
    clocks : int
        How long it was looked at.

    Attributes
    ----------
    answers : int
        Answers, reports not counted.
    """

    def __init__(self, output: Text, axes: Sequence[Axis], byte: int, report: int, clocks: int
                 ) -> None:
        self._axes, self._report, self._clocks = axes, report, clocks
        self.failures: list[Failure] = []
        self._taken = 0
        self._connections = [(-1, -1, False)]
        self._points: dict[int, Sequence[int]] = {}
        self._answers: list[tuple[int, bytes]] = []
        self._reports: list[tuple[int, list[int]]] = []
        self._split(output)
        self._due = partial(due, byte=byte, report=report)
        self._reasons = Reasons(self._answers, self._due, byte, clocks)
        self.answers = len(self._answers)

    def run(self, given: Iterator[Line]) -> None:
        """Look at all of it, up to the first answer or movement that is wrong."""
        self._times_of_reports()
        for line in given:
            self._compare(line.clock)
            if self.failures:
                return
            wrong, latest = self._interpret(line)
            if wrong:
                self._note(self._reasons.refuse(line.text, wrong, line.clock, latest + 2))
            self._taken = latest
        self._compare(self._clocks)
        self._note(self._reasons.rest())
        for number, one in enumerate(self._axes, 1):
            self.failures += check_limit_reports(
                number, one.blocked, one.perhaps, self._answers, self._due, self._clocks)

    def _note(self, failure: Failure | None) -> None:
        self.failures += [failure] if failure else []

    # What is said

    def _split(self, output: Text) -> None:
        place = 0
        while (end := output.text.find(b"\n", place)) >= 0:
            text, clock = output.text[place:end + 1], output.starts[place]
            if found := REPORT.fullmatch(text):
                self._reports.append((clock, [int(number) for number in found.groups()]))
            elif ANSWER.fullmatch(text):
                self._answers.append((clock, text))
            else:
                self.failures.append(Failure(clock, "answer", f"it says {text!r}"))
                break
            place = end + 1
        self._reports.reverse()
        self._told = [clock for clock, _ in reversed(self._reports)]

    def _compare(self, clock: int) -> None:
        """Compare reports up to a clock with where the axes are, and look at how these move."""
        while self._reports and self._reports[-1][0] <= clock:
            at, places = self._reports.pop()
            for one, place in zip(self._axes, places, strict=True):
                one.report(at, place)
        for one in self._axes:
            one.until(clock)
            self.failures += one.failures

    def _times_of_reports(self) -> None:
        wrong = [clock for clock in self._told if (clock - REPORT_DELAY) % self._report]
        if wrong:
            self.failures.append(Failure(wrong[0], "answer", "a report is not at its time"))

    def missing_reports(self) -> list[Failure]:
        """Return where a report is that must not be, or none where one must be."""
        ends = [*self._connections[1:], (self._clocks, self._clocks, False)]
        for (_, begin, connected), (end, *_) in zip(self._connections, ends, strict=True):
            first, last = begin + (0 if connected else 10), end - (10 if connected else 0)
            count = bisect_left(self._told, last) - bisect_left(self._told, first)
            least = (last - first) // self._report if connected else 0
            if last > first and not least <= count <= (least + 1 if connected else 0):
                return [Failure(first, "answer", f"{count} reports in {last - first} clocks, "
                                f"{'' if connected else 'not '}connected")]
        return []

    # What lines do

    def _interpret(self, line: Line) -> tuple[str, int]:
        """Do what a line asks for; say what is wrong with it, and when it is done at the latest."""
        if line.wrong == BREAK:
            self._move(range(AXES), "", line.clock, line.clock + AT_ONCE)
            return "", self._taken
        latest = max(line.clock, self._taken) + len(line.text) + LATENCY
        wrong, numbers = refusal(line.text)
        if line.wrong:
            return line.wrong, latest
        word = (re.match(rb"[A-Z]*", line.text) or [b""])[0]
        if not wrong and word in (b"MOV", b"GOTO") and not self._connections[-1][2]:
            wrong = "DISCONNECTED"
        if not wrong and word == b"GOTO" and numbers[0] not in self._points:
            wrong = "EMPTY"
        if not wrong:
            self._obey(word, numbers, line.clock, latest + 2)
        return wrong, latest

    def _obey(self, word: bytes, numbers: list[int], earliest: int, latest: int) -> None:
        every = range(AXES)
        if word in (b"CONNECT", b"DISCONNECT"):
            connected = word == b"CONNECT"
            if connected != self._connections[-1][2]:
                self._connections.append((earliest, latest, connected))
            if not connected:
                self._move(every, "", earliest, latest)
        elif word == b"MOV":
            self._move(numbers[:1], "C" if numbers[1] > 0 else "CC", earliest, latest)
        elif word == b"STOP":
            self._move(numbers, "", earliest, latest)
        elif word == b"VEL":
            self._axes[numbers[0]].rate = numbers[1]
            self._axes[numbers[0]].mode(earliest, latest)
        elif word == b"P":
            self._points[numbers[0]] = numbers[1:]
        elif word == b"GOTO":
            for one, place in zip(self._axes, self._points[numbers[0]], strict=True):
                one.point = place
            self._move(every, "GOTO", earliest, latest)
        else:
            for one, place in zip(self._axes, numbers or [0] * AXES, strict=True):
                one.call(place, earliest, latest)

    def _move(self, chosen: Sequence[int], goes: str, earliest: int, latest: int) -> None:
        for number in chosen:
            self._axes[number].go(goes, earliest, latest)
