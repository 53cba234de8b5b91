"""`single` at the level of frames: what each is answered, where the motor may go."""

import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tb.fuzz.answers import AnswerSession
from tb.fuzz.frames import Frame
from tb.fuzz.trajectory import Effect, Failure, Mode, Steps
from tb.uart import Text

from .lines import ASKS, GREETING, HELP, LEGAL, ROOM, START_SPEED, refusal, word

__all__ = ["PHASES", "FrameSession", "motor"]

PHASES = (0b0001, 0b0101, 0b0100, 0b0110, 0b0010, 0b1010, 0b1000, 0b1001)
"""Coil words forward."""

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


class FrameSession(AnswerSession):
    """What frames ask for, and what they were answered; see `AnswerSession`.

    Parameters
    ----------
    steps : Steps
        What its motor did.

    Attributes
    ----------
    effects : list of Effect
        What the motor was asked to do.
    """

    greeting, room = GREETING + HELP, ROOM
    longest_answer = len(b"x:9999\r\nok\r\n")

    def __init__(self, output: Text, floods: Sequence[tuple[int, int]], ends: Sequence[int],
                 byte: int, steps: Steps) -> None:
        super().__init__(output, floods, ends, byte)
        self.steps = steps
        self.effects: list[Effect] = []
        self._target, self._speed, self._enable = 0, START_SPEED, 1
        self._mode(-1, -1)

    def pattern(self, frame: Frame) -> bytes:
        """Return a regular expression for the answer to a frame."""
        wrong = frame.wrong or refusal(frame.text)
        if wrong:
            return b"err %s\r\n" % wrong.encode()
        return ASKS.get(word(frame.text), rb"ok\r\n")

    def flood_pattern(self, frames: Sequence[Frame]) -> bytes:
        """Return a regular expression for every answer in a flood of frames."""
        return rb"|".join({DAMAGED, *map(self.pattern, frames)})

    def may(self, answer: bytes, frame: Frame | None) -> bool:
        """Return whether an answer may be to a frame, or to what loss has left of some."""
        return answer == DAMAGED or bool(frame and re.fullmatch(self.pattern(frame), answer))

    def least(self, answer: bytes, frames: Sequence[Frame]) -> int:
        """Return the bytes that wait, at least, of a frame with an answer, with the end."""
        if answer == DAMAGED:
            return 1
        return 1 + min((len(frame.text) for frame in frames if self.may(answer, frame)), default=0)

    def obey(self, frame: Frame, found: re.Match[bytes]) -> None:
        """Check a value in the answer to a frame, and note what the frame asks for."""
        starts, place = self.output.starts, found.start()
        if found.groups():
            value, low, high = int(found[1]), self._speed, self._speed
            if frame.text[:1] in b"xX":
                low, high = self.steps.between(starts[place] - 2, starts[place + 2])
            if not low <= value <= high:
                self.failures.append(Failure(
                    starts[place + 2], "place",
                    f"{frame.text!r} is answered by {value}, which is {low} to {high}"))
        self.may_obey(frame, starts[place])

    def may_obey(self, frame: Frame, end: int) -> None:
        """Note what a frame asks for, obeyed between its own clock and another."""
        own = word(frame.text)
        if frame.wrong or refusal(frame.text) or own not in LEGAL:
            return
        number = int(frame.text[len(own):])
        if own == b"X":
            self._target = number
        elif own == b"V":
            self._speed = number
        else:
            self._enable = number
        self._mode(frame.clock, end + 2)

    def check_flooded(self, answer: bytes, end: int) -> None:
        """Do nothing: answers in a flood are compared as they come, not their values."""

    def _mode(self, earliest: int, latest: int) -> None:
        self.effects.append(Effect(earliest, latest, Mode(
            self._target, self._target, self._speed, bool(self._enable))))
