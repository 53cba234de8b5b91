"""`positioner` at the level of lines: what each is answered, where the motors may go."""

import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence

from numpy.typing import NDArray

from tb.fuzz.trajectory import Failure
from tb.uart import Text

from .answers import STATE, Answers, Due
from .axes import Axis
from .limits import check_limit_reports
from .lines import AXES, BREAK, Line, refusal

__all__ = ["LineSession"]

REPORT = re.compile(rb"# POS (-?\d+) (-?\d+) (-?\d+) :")
ANSWER = re.compile(rb"(?:! (?:[A-Z]+|LIMIT MOT[123])|ok|STATE(?: (?:0|-?[1-9]\d*)){14})\n")
LATENCY, BYTE = 40, 3
"""Clocks from the end of a line to what it does, and besides those of each byte."""

AT_ONCE = 3
"""Clocks from a break to what it does."""

REPORT_DELAY = 4
"""Clocks from a multiple of the time between reports, from power-up, to the first bit of one. In
the first of them it is sampled."""


class LineSession:
    """What lines ask for, and what was said.

    Parameters
    ----------
    output : Text
        What the machine said.
    axes : sequence of Axis
        What its axes did.
    pins : mapping of str to array
        The levels of `limits` and `moving`.
    byte, report, second : int
        Clocks of a byte, from report to report, and of a second.
    clocks : int
        How long it was looked at.

    Attributes
    ----------
    answers : int
        Answers, reports not counted.
    """

    def __init__(self, output: Text, axes: Sequence[Axis], pins: Mapping[str, NDArray], *,
                 byte: int, report: int, second: int, clocks: int) -> None:
        self._axes, self._pins = axes, pins
        self._report, self._second, self._clocks = report, second, clocks
        self.failures: list[Failure] = []
        self._taken = 0
        self._acknowledges = False
        self._states_requested = 0
        self._connections = [(-1, -1, False)]
        self._points: dict[int, Sequence[int]] = {}
        self._answers: list[tuple[int, bytes]] = []
        #: Positions of reports, and all numbers of states.
        self._reports: list[tuple[int, list[int]]] = []
        self._split(output)
        self._due = Due(byte, report)
        self._expected_answers = Answers(self._answers, self._due, byte, clocks)
        self.answers = len(self._answers)

    def run(self, given: Iterator[Line]) -> None:
        """Look at all of it, up to the first answer or movement that is wrong."""
        self._times_of_reports()
        for line in given:
            self._compare(line.clock)
            if self.failures:
                return
            answer, latest = self._interpret(line)
            if answer:
                self._note(self._expected_answers.answer(
                    line.text, answer, line.clock, latest + 2))
            self._taken = latest
        self._compare(self._clocks)
        self._note(self._expected_answers.rest())
        for number, one in enumerate(self._axes, 1):
            self.failures += check_limit_reports(
                number, one.blocked, one.perhaps, self._answers, self._due, self._clocks,
                state_waits=self._states_requested > len(self._states))

    def _note(self, failure: Failure | None) -> None:
        self.failures += [failure] if failure else []

    # What is said

    def _split(self, output: Text) -> None:
        place = 0
        while (end := output.text.find(b":" if output.text[place:place + 1] == b"#" else b"\n",
                                       place)) >= 0:
            text, clock = output.text[place:end + 1], output.starts[place]
            if found := REPORT.fullmatch(text):
                self._reports.append((clock, [int(number) for number in found.groups()]))
            elif ANSWER.fullmatch(text):
                self._answers.append((clock, text))
                if text.startswith(STATE):
                    self._reports.append((clock, [int(word) for word in text.split()[1:]]))
            else:
                self.failures.append(Failure(clock, "answer", f"it says {text!r}"))
                break
            place = end + 1
        self._reports.reverse()
        self._told = [clock for clock, _ in reversed(self._reports)]
        self._states = [clock for clock, text in self._answers if text.startswith(STATE)]

    def _compare(self, clock: int) -> None:
        """Compare reports up to a clock with where the axes are, and look at how these move."""
        while self._reports and self._reports[-1][0] <= clock:
            at, numbers = self._reports.pop()
            if len(numbers) > AXES:
                self._check_state(at - REPORT_DELAY, numbers)
                numbers = numbers[-1 - AXES:-1]
            for one, place in zip(self._axes, numbers, strict=True):
                one.report(at, place)
        for one in self._axes:
            one.until(clock)
            self.failures += one.failures

    def _check_state(self, clock: int, numbers: Sequence[int]) -> None:
        """Compare the numbers of a state, but the positions, with what was in a clock."""
        def pins(name: str) -> list[int]:
            return [int(self._pins[name][clock]) >> axis & 1 for axis in range(AXES)]

        connected, moving, rates, limits = (numbers[0], *(
            numbers[1 + AXES * part:1 + AXES * (part + 1)] for part in range(3)))
        expected = [("moving", moving, pins("moving")), ("limits", limits, pins("limits")),
                    ("seconds", numbers[-1], max(0, clock - 1) // self._second)]
        if clock > self._taken + 2:
            expected += [("connected", connected, self._connections[-1][2]),
                         ("rates", rates, [one.rate for one in self._axes])]
        self.failures += [
            Failure(clock, "answer", f"{name} is {right!r}, and a state has {given!r}")
            for name, given, right in expected if given != right]

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
            if not connected:
                count -= bisect_left(self._states, last) - bisect_left(self._states, first)
            least = (last - first) // self._report if connected else 0
            if last > first and not least <= count <= (least + 1 if connected else 0):
                return [Failure(first, "answer", f"{count} reports in {last - first} clocks, "
                                f"{'' if connected else 'not '}connected")]
        return []

    # What lines do

    def _interpret(self, line: Line) -> tuple[bytes, int]:
        """Do what a line requests; return its answer, and when it is done at the latest."""
        if line.wrong == BREAK:
            self._move(range(AXES), "", line.clock, line.clock + AT_ONCE)
            return b"", self._taken
        latest = max(line.clock, self._taken) + BYTE * len(line.text) + LATENCY
        wrong, numbers = refusal(line.text)
        wrong = line.wrong or wrong
        word = (re.match(rb"[A-Z]*", line.text) or [b""])[0]
        if not wrong and word in (b"MOV", b"GOTO") and not self._connections[-1][2]:
            wrong = "DISCONNECTED"
        if not wrong and word == b"GOTO" and numbers[0] not in self._points:
            wrong = "EMPTY"
        if wrong:
            return b"! %s\n" % wrong.encode(), latest
        self._obey(word, numbers, line.clock, latest + 2)
        if word == STATE:
            self._states_requested += 1
            return STATE, latest
        return b"ok\n" if self._acknowledges else b"", latest

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
        elif word == b"ACK":
            self._acknowledges = bool(numbers[0])
        elif word != STATE:
            for one, place in zip(self._axes, numbers or [0] * AXES, strict=True):
                one.call(place, earliest, latest)

    def _move(self, chosen: Sequence[int], goes: str, earliest: int, latest: int) -> None:
        for number in chosen:
            self._axes[number].go(goes, earliest, latest)
