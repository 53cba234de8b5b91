"""Frames and their answers: one each, in turn, soon; only in a flood may frames be lost."""

import re
from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence

from ..uart import Text
from .floods import PROMPT, Backlog, beyond_room, out_of_turn, unanswered
from .frames import Frame
from .trajectory import NEVER, Failure

__all__ = ["AnswerSession"]


class AnswerSession(ABC):
    """Compares answers with frames. What a frame asks for, and its answer, is the machine's.

    Parameters
    ----------
    output : Text
        What the machine sent.
    floods : sequence of pairs
        From which clock to which there were more frames than could be answered. One that goes on
        when the session ends has its end at ``NEVER``, or later.
    ends : sequence of int
        The clocks of bytes that end a frame.
    byte : int
        Clocks of a byte.

    Attributes
    ----------
    failures : list of Failure
        What is wrong, up to the first answer that is.
    answers : int
        How many there were.
    """

    greeting = b""
    """What the machine sends at power-up."""

    room: int
    """Bytes and ends of frames that can wait."""

    longest_answer: int
    """Bytes of the longest answer."""

    def __init__(self, output: Text, floods: Sequence[tuple[int, int]], ends: Sequence[int],
                 byte: int) -> None:
        self.output, self.byte = output, byte
        self._floods, self._ends = floods, ends
        self.failures: list[Failure] = []
        self.answers = 0

    def run(self, given: Iterable[Frame]) -> None:
        """Compare all of them, up to the first answer that is wrong."""
        place, text = len(self.greeting), self.output.text
        if text[:place] != self.greeting:
            self.fail(0, f"no greeting, but {text[:place]!r}")
            return
        floods = iter([*self._floods, (1 << 62, 1 << 62)])
        begin, end = next(floods)
        last, flooded = -1, []
        backlog = Backlog(self.room, self.byte)
        for frame in given:
            while frame.clock >= end:
                place = self._flood(flooded, last, place, end)
                (begin, end), flooded, backlog = next(floods), [], Backlog(self.room, self.byte)
            if self.failures:
                return
            if frame.clock >= begin and not (end < NEVER and backlog.fits(frame)):
                flooded.append(frame)
                self.may_obey(frame, end)
                continue
            place, last = self._answer(frame, place), frame.clock
            if frame.clock >= begin and not self.failures:
                backlog.answered(frame, self.output.starts[place - 1])
        if begin < 1 << 62 and not self.failures:
            place = self._flood(flooded, last, place, end)
        if place < len(text) and not self.failures:
            self.fail(self.output.starts[place],
                      f"an answer to no frame: {text[place:place + 40]!r}")

    def fail(self, clock: int, message: str) -> None:
        """Note an answer that is wrong."""
        self.failures.append(Failure(clock, "answer", message))

    @abstractmethod
    def pattern(self, frame: Frame) -> bytes:
        """Give a regular expression for the answer to a frame."""

    @abstractmethod
    def obey(self, frame: Frame, found: re.Match[bytes]) -> None:
        """Check the answer to a frame, and note what the frame asks for."""

    @abstractmethod
    def may(self, answer: bytes, frame: Frame | None) -> bool:
        """Say whether an answer in a flood may be to a frame, or to what loss has left of some."""

    @abstractmethod
    def least(self, answer: bytes, frames: Sequence[Frame]) -> int:
        """Give the bytes that wait, at least, of the frame that has an answer, with the end."""

    @abstractmethod
    def flood_pattern(self, frames: Sequence[Frame]) -> bytes:
        """Give a regular expression for every answer in a flood of frames."""

    @abstractmethod
    def may_obey(self, frame: Frame, end: int) -> None:
        """Note what a frame of a flood asks for, which may be obeyed up to the end of the flood."""

    @abstractmethod
    def check_flooded(self, answer: bytes, end: int) -> None:
        """Check an answer in a flood that ends in a clock."""

    def _answer(self, frame: Frame, place: int) -> int:
        """Check the answer to a frame; give its end."""
        text, starts = self.output.text, self.output.starts
        expected = self.pattern(frame)
        found = re.compile(expected).match(text, place)
        before = (starts[place - 1] if place else 0) + self.byte
        due = max(frame.clock, before) + PROMPT * self.byte
        if not found or not frame.clock < starts[place] <= due:
            shown = repr(text[place:place + 42]) if place < len(text) else "nothing"
            self.fail(starts[place] if place < len(text) else due,
                      f"frame {frame.text[:40]!r} is answered by {shown}, not {expected!r}")
            return place
        self.answers += 1
        self.obey(frame, found)
        return found.end()

    def _flood(self, flooded: Sequence[Frame], last: int, place: int, end: int) -> int:
        """Check the answers to what is left of a flood after the last frame that had room.

        Frames may be lost, or answered as damaged. Others are answered in their turn, and none
        waits for ever. Bytes may be lost between frames too: then what follows, up to the end of a
        frame, is one more damaged frame.
        """
        text, starts = self.output.text, self.output.starts
        stop, cut = self.output.before(end), end >= NEVER
        found = list(re.compile(self.flood_pattern(flooded)).finditer(text, place, stop))
        if stop - place - sum(len(one[0]) for one in found) > cut * self.longest_answer:
            self.fail(end, f"a flood is answered by what is no answer: {text[place:stop][:200]!r}")
        elif flooded and not found and not cut:
            self.fail(end, f"{len(flooded)} frames of a flood have no answer")
        answers = [(starts[one.start()], one[0]) for one in found]
        ends = self._ends[bisect_right(self._ends, last):bisect_left(self._ends, end)]
        if (wrong := out_of_turn(answers, ends, flooded, self.may)) is not None:
            clock, answer = answers[wrong]
            self.fail(clock, f"a flood is answered by {answer!r}, which is out of turn")
        sizes = [(clock, self.least(answer, flooded)) for clock, answer in answers]
        if (wrong := beyond_room(sizes, ends, self.room)) is not None:
            self.fail(answers[wrong][0],
                      f"more frames are answered after a flood than {self.room} bytes can hold")
        self.failures += unanswered(flooded, self.output, self.byte, end)
        for _, answer in answers:
            self.check_flooded(answer, end)
        self.answers += len(answers)
        return stop
