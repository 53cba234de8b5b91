"""Which line an answer of `positioner` belongs to."""

from collections import deque
from dataclasses import dataclass

from .positioner_lines import STATE, Ok, Refusal, State

__all__ = ["MOST_UNANSWERED", "Line", "Unanswered"]

#: Lines that may be unanswered; the machine holds 32 answers.
MOST_UNANSWERED = 24


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
    before have been answered, or never will be. So one STATE is on the way at a time.

    Attributes
    ----------
    asked : Line or None
        The STATE on the way.
    in_doubt : bool
        Answers are not attributed to lines, until that of a STATE that is sent from now on.
    quiet_at : float
        Time from which that STATE must be sent: an earlier one may be answered until then.
    """

    def __init__(self) -> None:
        self._lines: deque[Line] = deque()
        self.asked: Line | None = None
        self.in_doubt = True
        self.quiet_at = 0.0

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
            self.asked = line
        return line

    def give_up_asked(self, quiet_at: float) -> None:
        """Take all lines for lost, the STATE too, though answers may come until `quiet_at`."""
        self.asked, self.quiet_at = None, quiet_at
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

    def take(self, answer: Ok | Refusal | State) -> Line | None:
        """Return the line that an answer belongs to, if that is known."""
        if isinstance(answer, State):
            return self._take_state(answer)
        # One that comes in front of a STATE's is left over, or it is that STATE that was damaged.
        if self.in_doubt or not self._lines or self._lines[0] is self.asked:
            return None
        line = self._lines.popleft()
        line.answer = answer
        return line

    def _take_state(self, state: State) -> Line | None:
        if (asked := self.asked) is None:
            return None
        while (line := self._lines.popleft()) is not asked:
            line.lost = True
        asked.answer, self.asked = state, None
        self.in_doubt &= not asked.resumes
        return asked
