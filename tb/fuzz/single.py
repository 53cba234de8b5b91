"""`single` at the level of frames: what each is answered, where the motor may go."""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .floods import PROMPT, Backlog, beyond_room, out_of_turn, unanswered
from .line import CUT, Text
from .single_lines import ASKS, GREETING, HELP, LEGAL, ROOM, Frame, refusal, word
from .trajectory import Effect, Failure, Mode, Steps

__all__ = ["FrameSession", "motor"]

PHASES = (0b0001, 0b0101, 0b0100, 0b0110, 0b0010, 0b1010, 0b1000, 0b1001)
"""Coil words forward."""

LONGEST_ANSWER = len(b"x:9999\r\nok\r\n")
DAMAGED = b"err command\r\n"


def motor(seen: Mapping[str, NDArray]) -> tuple[Steps, list[Failure]]:
    """Count the steps of the motor at its coils; say where they are no steps."""
    coils = seen["coils"]
    places = np.full(16, -1)
    places[list(PHASES)] = range(8)
    failures = [Failure(int(n), "pins", f"coil word {coils[n]:04b}, which is none")
                for n in np.flatnonzero((places[coils] < 0) & (coils != 0))[:1]]
    failures += [Failure(int(n) + 2, "pins", "power at the coils that is not switched on") for n in
                 np.flatnonzero((coils[2:] != 0) & (seen["enable"][:-2] == 0)
                                & (seen["enable"][1:-1] == 0))[:1]]
    on = np.flatnonzero(places[coils] >= 0)
    turned = np.diff(places[coils[on]])
    moved = np.flatnonzero(turned)
    direction = (turned[moved] + 4) % 8 - 4
    failures += [Failure(int(on[moved[n] + 1]), "pins", f"{direction[n]} phases at once")
                 for n in np.flatnonzero(abs(direction) != 1)[:1]]
    steps = Steps.of(on[moved + 1], direction)
    position = seen["position"].astype(int)
    reported = np.flatnonzero(np.diff(position)) + 1
    same = min(len(reported), len(steps.clock))
    wrong = np.flatnonzero((abs(reported[:same] - steps.clock[:same]) > 1)
                           | (np.diff(position)[reported[:same] - 1] != direction[:same]))
    if wrong.size or abs(len(reported) - len(steps.clock)) > 1:
        clock = int(reported[wrong[0]]) if wrong.size else len(coils) - 1
        failures.append(Failure(
            clock, "place", "the position that is shown is not that of the steps"))
    return steps, failures


@dataclass
class FrameSession:
    """What frames ask for, and what they were answered.

    Parameters
    ----------
    output : Text
        What the machine said.
    steps : Steps
        What its motor did.
    floods : sequence of pairs
        From which clock to which there were more frames than could be answered. One that goes on
        when the session ends has its end at ``CUT``, or later.
    ends : sequence of int
        When returns came.
    byte : int
        Clocks of a byte.
    """

    output: Text
    steps: Steps
    floods: Sequence[tuple[int, int]]
    ends: Sequence[int]
    byte: int
    effects: list[Effect] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    answers: int = 0
    target: int = 0
    speed: int = 100
    enable: int = 1

    def run(self, given: Iterator[Frame]) -> None:
        """Look at all of it, up to the first answer that is wrong."""
        self._mode(-1, -1)
        place = len(GREETING + HELP)
        if self.output.text[:place] != GREETING + HELP:
            self.failures.append(Failure(
                0, "answer", f"no greeting, but {self.output.text[:place]!r}"))
            return
        floods = iter([*self.floods, (1 << 62, 1 << 62)])
        begin, end = next(floods)
        last, flooded = -1, []
        backlog = Backlog(ROOM, self.byte)
        for frame in given:
            while frame.clock >= end:
                place = self._flood(flooded, last, place, end)
                begin, end = next(floods)
                flooded, backlog = [], Backlog(ROOM, self.byte)
            if self.failures:
                return
            if frame.clock >= begin and not (end < CUT and backlog.fits(frame)):
                flooded.append(frame)
                self._obey(frame, frame.clock, end)
                continue
            place, last = self._answer(frame, place), frame.clock
            if frame.clock >= begin and not self.failures:
                backlog.answered(frame, self.output.starts[place - 1])
        if begin < 1 << 62 and not self.failures:
            place = self._flood(flooded, last, place, end)
        if place < len(self.output.text) and not self.failures:
            self.failures.append(Failure(
                self.output.starts[place], "answer",
                f"an answer to no frame: {self.output.text[place:place + 20]!r}"))

    def _expected(self, frame: Frame) -> bytes:
        wrong = frame.wrong or refusal(frame.text)
        if wrong:
            return b"err %s\r\n" % wrong.encode()
        return ASKS.get(word(frame.text), rb"ok\r\n")

    def _least(self, answer: bytes, frames: Sequence[Frame]) -> int:
        """Give the bytes that wait, at least, of a frame with an answer, with the end."""
        if answer == DAMAGED:
            return 1
        return 1 + min((len(frame.text) for frame in frames if self._may(answer, frame)), default=0)

    def _may(self, answer: bytes, frame: Frame | None) -> bool:
        return answer == DAMAGED or bool(
            frame and re.fullmatch(self._expected(frame), answer))

    def _answer(self, frame: Frame, place: int) -> int:
        """Look at the answer to a frame; say where it ends."""
        text, starts = self.output.text, self.output.starts
        expected = self._expected(frame)
        found = re.compile(expected).match(text, place)
        due = max(frame.clock, starts[place - 1] + self.byte) + PROMPT * self.byte
        if not found or not frame.clock < starts[place] <= due:
            shown = repr(text[place:place + 20]) if place < len(text) else "nothing"
            when = starts[place] if place < len(text) else due
            self.failures.append(Failure(
                when, "answer",
                f"frame {frame.text[:40]!r} is answered by {shown}, not {expected!r}"))
            return place
        self.answers += 1
        if found.groups():
            self._value(frame, int(found[1]), place)
        self._obey(frame, frame.clock, starts[place])
        return found.end()

    def _value(self, frame: Frame, value: int, place: int) -> None:
        low = high = self.speed
        if frame.text[:1] in b"xX":
            low, high = self.steps.between(self.output.starts[place] - 2,
                                           self.output.starts[place + 2])
        if not low <= value <= high:
            self.failures.append(Failure(
                self.output.starts[place + 2], "place",
                f"{frame.text!r} is answered by {value}, which is {low} to {high}"))

    def _obey(self, frame: Frame, earliest: int, latest: int) -> None:
        """Do what a frame asks for, some time between two clocks."""
        own = word(frame.text)
        if frame.wrong or refusal(frame.text) or own not in LEGAL:
            return
        number = int(frame.text[len(own):])
        if own == b"X":
            self.target = number
        elif own == b"V":
            self.speed = number
        else:
            self.enable = number
        self._mode(earliest, latest + 2)

    def _mode(self, earliest: int, latest: int) -> None:
        self.effects.append(Effect(earliest, latest, Mode(
            self.target, self.target, self.speed, bool(self.enable))))

    def _flood(self, flooded: Sequence[Frame], last: int, place: int, end: int) -> int:
        """Look at the answers to what is left of a flood behind the last frame that had room.

        Frames may be lost, or told to be damaged. Others are answered in their turn, and none waits
        for ever. Bytes may be lost between frames too: then what follows, up to a return, is a
        damaged frame more.
        """
        stop, cut = self.output.before(end), end >= CUT
        right = rb"|".join({DAMAGED, *map(self._expected, flooded)})
        answers = list(re.finditer(right, self.output.text[place:stop]))
        rest = stop - place - sum(len(answer[0]) for answer in answers)
        if rest > cut * LONGEST_ANSWER:
            self.failures.append(Failure(
                end, "answer", "a flood is answered by what is no answer: "
                f"{self.output.text[place:stop][:200]!r}"))
        elif flooded and not answers and not cut:
            self.failures.append(Failure(end, "answer", f"{len(flooded)} frames of a flood have "
                                         "no answer"))
        begun = [(self.output.starts[place + answer.start()], answer[0]) for answer in answers]
        ends = self.ends[bisect_right(self.ends, last):bisect_left(self.ends, end)]
        wrong = out_of_turn(begun, ends, flooded, self._may)
        if wrong is not None:
            clock, text = begun[wrong]
            self.failures.append(Failure(
                clock, "answer", f"a flood is answered by {text!r}, which is out of turn"))
        sizes = [(clock, self._least(text, flooded)) for clock, text in begun]
        if (wrong := beyond_room(sizes, ends, ROOM)) is not None:
            self.failures.append(Failure(begun[wrong][0], "answer", "more frames are answered "
                                         f"behind a flood than {ROOM} bytes can be"))
        self.failures += unanswered(flooded, self.output, self.byte, end)
        self.answers += len(answers)
        return stop
