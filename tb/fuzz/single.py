"""`single` at the level of frames: which are legal, what each is answered, where it may go."""

import random
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .floods import PROMPT, Backlog, out_of_turn, silence
from .line import CUT, Heard, Text
from .pieces import Dialect
from .ways import Effect, Failure, Mode, Steps

__all__ = ["DIALECT", "ENDS", "Frame", "FrameSession", "begin", "frames", "motor", "refusal"]

PHASES = (0b0001, 0b0101, 0b0100, 0b0110, 0b0010, 0b1010, 0b1000, 0b1001)
"""Coil words forward."""

POSITIONS, SPEEDS, LONGEST = 10_000, 60_000, 126
LONGEST_ANSWER = len(b"x:9999\r\nok\r\n")
ROOM = 127
"""Bytes and ends of frames that can wait."""

ENDS = b"\r"
"""Bytes that end a frame."""

GREETING, HELP = b"!\r\n", b"?\r\n"
"""Short ones, so that there is time for more."""

DAMAGED = b"err command\r\n"

_WORD = re.compile(rb"[^ 0-9+-]*")
_ASKS = {b"X?": rb"x:(\d+)\r\nok\r\n", b"V?": rb"v:(\d+)\r\nok\r\n",
         b"D": re.escape(HELP + b"ok\r\n")}
_LEGAL = {b"X": range(POSITIONS), b"V": range(1, SPEEDS), b"E": range(2)}


class Frame(NamedTuple):
    """A frame that has ended: when, what is in it, and what is wrong with the bytes themselves."""

    clock: int
    text: bytes
    wrong: str


def frames(heard: Iterator[Heard], ends: bytes = ENDS, longest: int = LONGEST
           ) -> Iterator[Frame]:
    """Give the frames among bytes: from ``:`` to one of `ends`, begun anew at each ``:``.

    A byte outside that lacks its stop bit may have been a ``:``, and begins a damaged one.
    """
    text: bytearray | None = None
    damaged = False
    for clock, byte, error, _ in heard:
        if byte == ord(":"):
            text, damaged = bytearray(), error
        elif text is not None or error:
            text = bytearray() if text is None else text
            damaged |= error
            if byte in ends:
                wrong = "command" if damaged else "length" if len(text) > longest else ""
                yield Frame(clock, bytes(text), wrong)
                text = None
            else:
                text.append(byte)


def refusal(text: bytes) -> str:
    """Say what is wrong with the text of a frame, or nothing."""
    word = _word(text)
    rest = text[len(word):]
    if word in _ASKS:
        return "command" if rest else ""
    if word not in _LEGAL:
        return "command"
    if not re.fullmatch(rb"[0-9]+", rest):
        return "number"
    return "" if int(rest) in _LEGAL[word] else "range"


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
    way = (turned[moved] + 4) % 8 - 4
    failures += [Failure(int(on[moved[n] + 1]), "pins", f"{way[n]} phases at once")
                 for n in np.flatnonzero(abs(way) != 1)[:1]]
    steps = Steps.of(on[moved + 1], way)
    position = seen["position"].astype(int)
    told = np.flatnonzero(np.diff(position)) + 1
    same = min(len(told), len(steps.clock))
    wrong = np.flatnonzero((abs(told[:same] - steps.clock[:same]) > 1)
                           | (np.diff(position)[told[:same] - 1] != way[:same]))
    if wrong.size or abs(len(told) - len(steps.clock)) > 1:
        clock = int(told[wrong[0]]) if wrong.size else len(coils) - 1
        failures.append(Failure(
            clock, "place", "the position that is shown is not that of the steps"))
    return steps, failures


@dataclass
class FrameSession:
    """What frames ask for, and what they were answered.

    Parameters
    ----------
    said : Text
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

    said: Text
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
        if self.said.text[:place] != GREETING + HELP:
            self.failures.append(Failure(
                0, "answer", f"no greeting, but {self.said.text[:place]!r}"))
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
                backlog.answered(frame, self.said.starts[place - 1])
        if begin < 1 << 62 and not self.failures:
            place = self._flood(flooded, last, place, end)
        if place < len(self.said.text) and not self.failures:
            self.failures.append(Failure(
                self.said.starts[place], "answer",
                f"an answer to no frame: {self.said.text[place:place + 20]!r}"))

    def _expected(self, frame: Frame) -> bytes:
        wrong = frame.wrong or refusal(frame.text)
        if wrong:
            return b"err %s\r\n" % wrong.encode()
        return _ASKS.get(_word(frame.text), rb"ok\r\n")

    def _may(self, answer: bytes, frame: Frame | None) -> bool:
        return answer == DAMAGED or bool(
            frame and re.fullmatch(self._expected(frame), answer))

    def _answer(self, frame: Frame, place: int) -> int:
        """Look at the answer to a frame; say where it ends."""
        text, starts = self.said.text, self.said.starts
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
            low, high = self.steps.between(self.said.starts[place] - 2,
                                           self.said.starts[place + 2])
        if not low <= value <= high:
            self.failures.append(Failure(
                self.said.starts[place + 2], "place",
                f"{frame.text!r} is answered by {value}, which is {low} to {high}"))

    def _obey(self, frame: Frame, earliest: int, latest: int) -> None:
        """Do what a frame asks for, some time between two clocks."""
        word = _word(frame.text)
        if frame.wrong or refusal(frame.text) or word not in _LEGAL:
            return
        number = int(frame.text[len(word):])
        if word == b"X":
            self.target = number
        elif word == b"V":
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
        stop, cut = self.said.before(end), end >= CUT
        right = rb"|".join({DAMAGED, *map(self._expected, flooded)})
        answers = list(re.finditer(right, self.said.text[place:stop]))
        rest = stop - place - sum(len(answer[0]) for answer in answers)
        if rest > cut * LONGEST_ANSWER:
            self.failures.append(Failure(
                end, "answer", "a flood is answered by what is no answer: "
                f"{self.said.text[place:stop][:200]!r}"))
        elif flooded and not answers and not cut:
            self.failures.append(Failure(end, "answer", f"{len(flooded)} frames of a flood have "
                                         "no answer"))
        begun = [(self.said.starts[place + answer.start()], answer[0]) for answer in answers]
        ends = self.ends[bisect_right(self.ends, last):bisect_left(self.ends, end)]
        wrong = out_of_turn(begun, ends, flooded, self._may)
        if wrong is not None:
            clock, text = begun[wrong]
            self.failures.append(Failure(
                clock, "answer", f"a flood is answered by {text!r}, which is out of turn"))
        self.failures += silence(flooded, self.said, self.byte, end)
        self.answers += len(answers)
        return stop


def _word(text: bytes) -> bytes:
    found = _WORD.match(text)
    return found[0].upper() if found else b""


def begin(rates: Sequence[int]) -> bytes:
    """Give the frames that set a speed and begin a long way."""
    return b":v%d\r:x9999\r" % tuple(rates)


def _legal(rng: random.Random) -> bytes:
    kind = rng.randrange(20)
    if kind < 8:
        number = rng.randrange(rng.choice([3, 20, 200, POSITIONS, POSITIONS + 3]))
        line = b":x%d\r" % number
    elif kind < 11:
        line = b":v%d\r" % rng.choice([rng.randrange(SPEEDS), rng.randrange(20_000, SPEEDS + 9)])
    else:
        line = rng.choice([b":x?\r", b":x?\r", b":v?\r", b":d\r", b":e0\r", b":e1\r", b":e1\r",
                           b":e2\r", b":\r"])
    return line.upper() if rng.random() < 0.2 else line


DIALECT = Dialect(
    _legal, quiet=(b":x?\r", b":v?\r", b":d\r", b":e2\r", b":x-1\r", b":zz\r", b"\r", b"ab", b":"),
    end=b"\r", letters=b":\r?0129xvedXVED +-", longest=LONGEST, room=ROOM, answer=15,
    begin=b":v30000\r", alive=b":e1\r:v59999\r:x0\r:x7\r:x?\r:v?\r")
"""How one speaks to it."""
