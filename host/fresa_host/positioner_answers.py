"""Which line an answer of `positioner` belongs to."""

from collections import deque
from dataclasses import dataclass

from .positioner_lines import OVERFLOW, STATE, Ok, Refusal, State

__all__ = ["MOST_UNANSWERED", "Line", "Unanswered"]

#: Lines that may be unanswered; the machine holds 31 answers.
MOST_UNANSWERED = 24

#: Most empty lines in front of a STATE.
MOST_EMPTY = 8


@dataclass(eq=False)
class Line:
    """A line that was sent.

    Attributes
    ----------
    order : bytes
        The line with its end.
    due : float
        Time in seconds when all of it is on the line.
    reports : int
        Reports that had come when it was sent.
    answer : Ok, Refusal, State or None
        Its answer, if that has come.
    lost : bool
        No answer is known, and none will be.
    at_once : bool
        No call waits for the answer: the next one raises a refusal, and sends it again if it is
        lost.
    """

    order: bytes
    due: float
    reports: int
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
    before have been answered, or never will be. So one STATE is on the way at a time. OVERFLOW
    stands for any number of answers, and leaves in doubt whose the later ones are. In doubt, empty
    lines are sent in front of STATE, which are refused: if as many refusals come in front of an
    answer, it is that of this STATE, and not of one that is late, or that another program sent.

    Attributes
    ----------
    query : Line or None
        The STATE on the way.
    in_doubt : bool
        Answers are not attributed to lines, until that of a STATE that is sent from now on.
    """

    def __init__(self) -> None:
        self._lines: deque[Line] = deque()
        self.query: Line | None = None
        self.in_doubt = True
        self._empty = 2  # the first may end a line that had begun
        self._refused = 0  # since the last answer to a STATE

    @property
    def last(self) -> Line | None:
        """The last line that is unanswered, except a STATE."""
        return next((line for line in reversed(self._lines) if line is not self.query), None)

    def add(self, order: bytes, due: float, reports: int) -> Line:
        """Note that a line is sent. If too many are unanswered, they are given up."""
        if len(self._lines) >= MOST_UNANSWERED:
            self.give_up()
        line = Line(order, due, reports)
        self._lines.append(line)
        if order == STATE:
            self.query = line
        return line

    @property
    def query_lines(self) -> bytes:
        """The lines to send to ask for a STATE."""
        return self._empty * b"\n" + STATE if self.in_doubt else STATE

    def give_up_query(self) -> None:
        """Take all lines for lost, the STATE too, though answers may still come."""
        self.query, self._empty = None, min(2 * self._empty, MOST_EMPTY)
        self.give_up()

    def give_up(self) -> None:
        """Take all lines but the STATE for lost, though answers may still come."""
        self.in_doubt = True
        kept = self.query
        for line in self._lines:
            line.lost = line is not kept
        self._lines = deque([kept] if kept else [])
        if kept:
            kept.resumes = False

    def take(self, answer: Ok | Refusal | State) -> Line | None:
        """Return the line that an answer belongs to, if that is known."""
        if isinstance(answer, State):
            return self._take_state(answer)
        if answer == OVERFLOW:  # it stands for any number of lines
            self.give_up()
            return None
        self._refused += isinstance(answer, Refusal)
        # One that comes in front of a STATE's is left over, or it is that STATE that was damaged.
        if self.in_doubt or not self._lines or self._lines[0] is self.query:
            return None
        line = self._lines.popleft()
        line.answer = answer
        return line

    def _take_state(self, state: State) -> Line | None:
        query, refused, self._refused = self.query, self._refused, 0
        if query is None or self.in_doubt and query.resumes and refused < self._empty - 1:
            return None  # of a STATE before
        while (line := self._lines.popleft()) is not query:
            line.lost = True
        query.answer, self.query = state, None
        if query.resumes:
            self.in_doubt, self._empty = False, 2
        return query
