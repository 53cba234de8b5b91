"""Floods of frames, where some may be lost: of which it is sure that there is room, and silence."""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from ..uart import Text
from .trajectory import NEVER, Failure

__all__ = ["PROMPT", "Backlog", "beyond_room", "out_of_turn", "unanswered"]

PROMPT = 8
"""Bytes of the line in which an answer begins when nothing goes before it."""

BESIDES = 10
"""Bytes that may wait besides whole frames: of one that is begun, or begun anew."""


class Frame(Protocol):
    """A frame that has ended."""

    @property
    def clock(self) -> int:
        """When."""
        ...

    @property
    def text(self) -> bytes:
        """What is in it."""
        ...


def _size(frame: Frame) -> int:
    return len(frame.text) + 2  # with what starts and ends it


class Backlog:
    """The frames of a flood that wait, for as long as there is room for all of them.

    Parameters
    ----------
    room : int
        Bytes for which there is room.
    byte : int
        Clocks of a byte.
    """

    def __init__(self, room: int, byte: int) -> None:
        self._room, self._byte = room - BESIDES, byte
        self._waiting: list[tuple[int, int]] = []  # when each was answered, and its size
        self._sure = True

    def fits(self, frame: Frame) -> bool:
        """Return whether a frame and all before it surely had room."""
        begin = frame.clock - _size(frame) * self._byte
        self._waiting = [one for one in self._waiting if one[0] >= begin]
        self._sure &= sum(size for _, size in self._waiting) + _size(frame) <= self._room
        return self._sure

    def answered(self, frame: Frame, clock: int) -> None:
        """Note when the answer to a frame has begun: so much has been read."""
        self._waiting.append((clock, _size(frame)))


Some = TypeVar("Some", bound=Frame)


def out_of_turn(answers: Sequence[tuple[int, bytes]], ends: Sequence[int], frames: Sequence[Some],
                may: Callable[[bytes, Some | None], bool]) -> int | None:
    """Find the first answer for which no frame can have ended; give its number.

    Each return ends one frame at most: that which was sent, or what loss has left of some. Each
    frame has one answer at most, and they come in turn.

    Parameters
    ----------
    answers : sequence of pairs
        The clock in which each begins, and what it is.
    ends : sequence of int
        When returns came, also such as are in no frame that was sent.
    frames : sequence of frames
        Those that were sent.
    may : callable
        Says whether an answer may be to a frame, or where none was sent.
    """
    sent = {frame.clock: frame for frame in frames}
    left = iter(ends)
    for number, (clock, text) in enumerate(answers):
        end = next((end for end in left if may(text, sent.get(end))), NEVER)
        if end >= clock:
            return number
    return None


def beyond_room(answers: Sequence[tuple[int, int]], ends: Sequence[int], room: int) -> int | None:
    """Find the first answer to a frame for which there was no room; give its number.

    No frame ends between two returns. So what is answered then has waited, all at once, but for the
    first, which was being read already.

    Parameters
    ----------
    answers : sequence of pairs
        The clock in which each begins, and how many bytes of its frame wait at least.
    ends : sequence of int
        When returns came.
    room : int
        Bytes that can wait.
    """
    behind, waited = -1, 0
    for number, (clock, size) in enumerate(answers):
        place = bisect_left(ends, clock)
        waited = waited + size if place == behind else 0
        if waited > room:
            return number
        behind = place
    return None


def unanswered(frames: Sequence[Frame], output: Text, byte: int, end: int) -> list[Failure]:
    """Return where the line was quiet before a frame and soon after it, so that it had room."""
    for frame in frames:
        place = output.before(frame.clock + 1)
        before = output.starts[place - 1] if place else -1
        after = output.starts[place] if place < len(output.starts) else NEVER
        due = frame.clock + PROMPT * byte
        if before < frame.clock - (_size(frame) + PROMPT) * byte and after > due < end:
            return [Failure(due, "answer", f"frame {frame.text[:40]!r} has no answer, and nothing "
                            "goes before it")]
    return []
