"""`positioner` at the level of lines: what each is answered, where the motors may go."""

import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .line import CUT, Text
from .positioner_lines import AXES, BREAK, DOWN, START_SPEED, UP, Line, refusal
from .ways import Effect, Failure, Mode, Steps

__all__ = ["LineSession", "motors"]

REPORT = re.compile(rb"# POS (-?\d+) (-?\d+) (-?\d+) :\n")
ANSWER = re.compile(rb"! [A-Z]+\n")
OVERFLOW = b"! OVERFLOW\n"
LATENCY = 40
"""Clocks, besides one a byte, from the end of a line to what it does."""


def motors(seen: Mapping[str, NDArray]) -> tuple[list[Steps], list[Failure]]:
    """Count the steps of the motors at their pins; say where one has no power."""
    found, failures = [], []
    for axis in range(AXES):
        step = seen["step"] >> axis & 1
        clock = np.flatnonzero(~step[:-1] & step[1:]) + 1
        way = np.where(seen["direction"][clock] >> axis & 1, 1, -1)
        found.append(Steps.of(clock, way))
        failures += [Failure(int(clock[n]), "pins", f"motor {axis + 1} steps without power")
                     for n in np.flatnonzero(seen["enable"][clock] >> axis & 1 == 0)[:1]]
    return found, failures


@dataclass
class _Motor:
    """What is known of a motor: `low` to `high` is what its place is called, less its steps."""

    steps: Steps
    effects: list[Effect]
    low: int = 0
    high: int = 0
    before: tuple[int, int] = (0, 0)
    loose_until: int = -1
    rate: int = START_SPEED
    goes: str = ""  # "", "C", "CC" or "GOTO"
    point: int = 0
    sure: bool = True

    def mode(self, earliest: int, latest: int) -> None:
        """Begin what it is to do now."""
        target = {"C": UP, "CC": DOWN}.get(self.goes, self.point)
        if self.goes != "GOTO" and max(abs(self.low), abs(self.high)) > 2**30:
            self.sure = False  # it may have come to where its range ends, and then it stops
        self.effects.append(Effect(earliest, latest, Mode(
            target - self.high, target - self.low, self.rate, bool(self.goes), self.sure)))

    def go(self, goes: str, earliest: int, latest: int) -> None:
        """Begin a movement, or end it."""
        self.goes, self.sure = goes, True
        self.mode(earliest, latest)

    def call(self, place: int, earliest: int, latest: int) -> None:
        """Call where it is a place, some time between two clocks."""
        low, high = self.steps.between(earliest, latest)
        self.before = (self.low, self.high) if self.loose_until < earliest else (
            min(self.before[0], self.low), max(self.before[1], self.high))
        self.low, self.high, self.loose_until = place - high, place - low, latest
        if self.goes == "GOTO":
            self.goes = ""
        self.mode(earliest, latest)

    def report(self, clock: int, place: int) -> tuple[int, int] | None:
        """Compare with what is reported of it; give what it could be where it is not."""
        least, most = self.steps.between(clock - 6, clock - 2)
        low, high = self.low, self.high
        if clock <= self.loose_until + 8:
            low, high = min(low, self.before[0]), max(high, self.before[1])
        if not least + low <= place <= most + high:
            return least + low, most + high
        if clock > self.loose_until + 8:
            self.low, self.high = max(low, place - most), min(high, place - least)
        return None


class LineSession:
    """What lines ask for, and what was said.

    Parameters
    ----------
    said : Text
        What the machine said.
    steps : sequence of Steps
        What its motors did.
    floods : sequence of pairs
        From which clock to which there were more lines than could be answered. One that goes on
        when the session ends has its end at ``CUT``, or later.
    byte, report : int
        Clocks of a byte, and from report to report.

    Attributes
    ----------
    effects : list of list of Effect
        What each motor was asked to do.
    answers : int
        Answers, reports not counted.
    """

    def __init__(self, said: Text, steps: Sequence[Steps], floods: Sequence[tuple[int, int]],
                 byte: int, report: int) -> None:
        self.floods, self.byte, self.report = floods, byte, report
        self.failures: list[Failure] = []
        self.answers = self._taken = 0
        self._motors = [_Motor(one, []) for one in steps]
        for one in self._motors:
            one.mode(-1, -1)
        self.effects = [one.effects for one in self._motors]
        self._connections = [(-1, -1, False)]
        self._points: dict[int, Sequence[int]] = {}
        self._said: list[tuple[int, bytes]] = []
        self._reports: list[tuple[int, list[int]]] = []
        self._split(said)

    def run(self, given: Iterator[Line]) -> None:
        """Look at all of it, up to the first answer that is wrong."""
        self._clock_of_reports()
        floods = iter([*self.floods, (1 << 62, 1 << 62)])
        begin, end = next(floods)
        flooded: list[tuple[Line, str]] = []
        for line in given:
            while line.clock >= end:
                self._flood(flooded, end)
                begin, end = next(floods)
                flooded = []
            self._compare(line.clock)
            if self.failures:
                return
            wrong, latest = self._judge(line)
            if line.clock >= begin:
                flooded.append((line, wrong))
            elif wrong:
                self._answer(line, wrong)
            self._taken = latest
        if begin < 1 << 62 and not self.failures:
            self._flood(flooded, end)
        self._compare(1 << 62)
        if self._said and not self.failures:
            clock, text = self._said[0]
            self.failures.append(Failure(clock, "answer", f"an answer to no line: {text!r}"))

    # What is said

    def _split(self, said: Text) -> None:
        place = 0
        while (end := said.text.find(b"\n", place)) >= 0:
            text, clock = said.text[place:end + 1], said.starts[place]
            if found := REPORT.fullmatch(text):
                self._reports.append((clock, [int(number) for number in found.groups()]))
            elif ANSWER.fullmatch(text):
                self._said.append((clock, text))
            else:
                self.failures.append(Failure(clock, "answer", f"it says {text!r}"))
                break
            place = end + 1
        self._reports.reverse()
        self._told = [clock for clock, _ in reversed(self._reports)]

    def _answer(self, line: Line, wrong: str) -> None:
        """Look at the answer to a line that is refused."""
        clock, text = self._said[0] if self._said else (1 << 62, b"")
        due = max(line.clock, self._last_answer) + 130 * self.byte
        if text != b"! %s\n" % wrong.encode() or not line.clock < clock <= due:
            self.failures.append(Failure(
                min(clock, due), "answer",
                f"line {line.text[:40]!r} is answered by {text!r}, not {wrong}"))
            return
        self._said.pop(0)
        self._last_answer = clock
        self.answers += 1

    _last_answer = 0

    def _flood(self, flooded: Sequence[tuple[Line, str]], end: int) -> None:
        """Look at the answers to a flood: each line has its own, until there are too many."""
        due = [b"! %s\n" % wrong.encode() for _, wrong in flooded if wrong]
        count = bisect_left(self._said, (end, b""))
        texts = [text for _, text in self._said[:count]]
        known = texts.index(OVERFLOW) if OVERFLOW in texts else count
        for place, (clock, text) in enumerate(self._said[:count]):
            if text != due[place] if place < min(known, len(due)) else text not in {OVERFLOW, *due}:
                self.failures.append(Failure(clock, "answer", f"a flood is answered by {text!r}"))
        if count > len(due) or known == count < len(due) and end < CUT:
            self.failures.append(Failure(
                end, "answer", f"{len(due)} bad lines have {count} answers"))
        self.answers += count
        self._said = self._said[count:]

    def _compare(self, clock: int) -> None:
        """Compare the reports up to a clock with where the motors are."""
        while self._reports and self._reports[-1][0] <= clock:
            at, places = self._reports.pop()
            for number, (one, place) in enumerate(zip(self._motors, places, strict=True), 1):
                if could := one.report(at, place):
                    self.failures.append(Failure(
                        at, "place", f"motor {number} is reported at {place}, and is at "
                        f"{could[0]} to {could[1]}"))

    def _clock_of_reports(self) -> None:
        wrong = [clock for clock in self._told if (clock - self._told[0]) % self.report]
        if wrong:
            self.failures.append(Failure(wrong[0], "answer", "a report is not at its time"))

    def missing_reports(self, clocks: int) -> list[Failure]:
        """Say where a report is that must not be, or none where one must be."""
        ends = [*self._connections[1:], (clocks, clocks, False)]
        for (_, begin, connected), (end, *_) in zip(self._connections, ends, strict=True):
            first, last = begin + (0 if connected else 10), end - (10 if connected else 0)
            count = bisect_left(self._told, last) - bisect_left(self._told, first)
            least = (last - first) // self.report if connected else 0
            if last > first and not least <= count <= (least + 1 if connected else 0):
                return [Failure(first, "answer", f"{count} reports in {last - first} clocks, "
                                f"{'' if connected else 'not '}connected")]
        return []

    # What lines do

    def _judge(self, line: Line) -> tuple[str, int]:
        """Do what a line asks for; say what is wrong with it, and when it is done at the latest."""
        latest = max(line.clock, self._taken) + len(line.text) + LATENCY
        wrong, numbers = refusal(line.text)
        if line.wrong == BREAK:
            self._move(range(AXES), "", line.clock, latest)
            return "", latest
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
            self._motors[numbers[0]].rate = numbers[1]
            self._motors[numbers[0]].mode(earliest, latest)
        elif word == b"P":
            self._points[numbers[0]] = numbers[1:]
        elif word == b"GOTO":
            for one, place in zip(self._motors, self._points[numbers[0]], strict=True):
                one.point = place
            self._move(every, "GOTO", earliest, latest)
        else:
            for one, place in zip(self._motors, numbers or [0] * AXES, strict=True):
                one.call(place, earliest, latest)

    def _move(self, chosen: Sequence[int], goes: str, earliest: int, latest: int) -> None:
        for number in chosen:
            self._motors[number].go(goes, earliest, latest)
