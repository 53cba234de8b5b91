"""Which line an answer of `positioner` belongs to."""

from collections import deque
from dataclasses import dataclass

from .positioner_lines import STATE, Ok, Refusal, State

__all__ = ["MOST_UNANSWERED", "QUIET_S", "Line", "Unanswered"]

#: Lines that may be unanswered; the machine holds 32 answers.
MOST_UNANSWERED = 24

#: Seconds without an answer after which no more come to lines that were given up.
QUIET_S = 0.5


@dataclass(eq=False)
class Line:
    """A line that was sent.

    Attributes
    ----------
    order : bytes
        The line with its end.
    due : float
        Time in seconds when all of it is on the line.
    answer : Ok, Refusal, State or None
        Its answer, if that has come.
    lost : bool
        No answer is known, and none will be.
    at_once : bool
        No call waits for the answer: the next one raises a refusal.
    """

    order: bytes
    due: float
    answer: Ok | Refusal | State | None = None
    lost: bool = False
    at_once: bool = False
    resumes: bool = True  # as STATE: answers behind its own can be attributed

    @property
    def ended(self) -> bool:
        """Whether it has been answered, or is lost."""
        return self.answer is not None or self.lost


class Unanswered:
    """The lines that were sent and not answered yet.

    The machine answers each line once, in the order of the lines. One answer too few, or too many,
    would shift all that follow. But the answer to STATE is like no other: when it comes, the lines
    before have been answered, or never will be. So one STATE is on the way at a time, and in doubt
    an empty line is sent in front of it, which is refused.

    Attributes
    ----------
    asked : Line or None
        The STATE on the way.
    in_doubt : bool
        Answers are not attributed to lines, until that of a STATE that is sent from now on.
    quiet_at : float
        Time from which that STATE must be sent: earlier lines may be answered until then.
    """

    def __init__(self) -> None:
        self._lines: deque[Line] = deque()
        self.asked: Line | None = None
        self.in_doubt = True
        self.quiet_at = 0.0
        self._refused = False  # since the STATE on the way was sent

    @property
    def last(self) -> Line | None:
        """The last line that is unanswered, except a STATE."""
        return next((line for line in reversed(self._lines) if line is not self.asked), None)

    def add(self, order: bytes, due: float) -> Line:
        """Note that a line is sent. If too many are unanswered, they are given up."""
        if len(self._lines) >= MOST_UNANSWERED:
            self.give_up()
        line = Line(order, due, resumes=due >= self.quiet_at)
        self._lines.append(line)
        if order == STATE:
            self.asked, self._refused = line, False
        return line

    def give_up_asked(self, now: float) -> None:
        """Take all lines for lost, the STATE too, though answers may still come."""
        self.asked, self.quiet_at = None, now + QUIET_S
        self.give_up()

    def give_up(self) -> None:
        """Take all lines but the STATE for lost, though answers may still come."""
        self.in_doubt = True
        kept = self.asked
        for line in self._lines:
            line.lost = line is not kept
        self._lines = deque([kept] if kept else [])
        if kept:
            kept.resumes = False

    def take(self, answer: Ok | Refusal | State, now: float) -> Line | None:
        """Return the line that an answer belongs to, if that is known."""
        if now < self.quiet_at:
            self.quiet_at = now + QUIET_S
        if isinstance(answer, State):
            return self._take_state(answer)
        self._refused |= isinstance(answer, Refusal)
        # One that comes in front of a STATE's is left over, or it is that STATE that was damaged.
        if self.in_doubt or not self._lines or self._lines[0] is self.asked:
            return None
        line = self._lines.popleft()
        line.answer = answer
        return line

    def _take_state(self, state: State) -> Line | None:
        asked = self.asked
        if asked is None or self.in_doubt and asked.resumes and not self._refused:
            return None  # of a STATE before, as that of the empty line in front has not come
        while (line := self._lines.popleft()) is not asked:
            line.lost = True
        asked.answer, self.asked = state, None
        self.in_doubt &= not asked.resumes
        return asked
