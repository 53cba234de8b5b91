"""Orders to the mill over a line that drops, doubles or changes bytes: each is done once.

`Sender` is the host's side of docs/serial-orders.md without I/O: it is given what was heard and
the time, and says what to send. `fresa_host.delivery` joins it to a port.
"""

import random
import zlib
from collections.abc import Sequence
from enum import Enum, auto

from .errors import MachineError, WasReset
from .order_lines import LAST_NUMBER, Answer, AnswerReader, Kind, Order, Outcome, request

__all__ = ["JobHalfDone", "JobRefused", "NotReady", "Order", "OrderRefused", "Phase", "Sender"]

ANSWER_TIME = 0.5
"""Seconds after which a request without an answer is sent again; both take 70 ms at 9600 baud."""

PAUSE = 0.2
"""Seconds until a request is sent again that was answered, but not as hoped. Answers to what was
sent twice are through by then, so that they do not make everything be sent twice from there on."""

CLOSING_TRIES = 8
"""A session that cannot be closed is left open: the job is done."""

RUNS = 256
"""Numbers of runs of a job. None is 0, for session 0 is none."""

QUIET = 0.5
"""Seconds from one question to the next when there is nothing to send."""


class NotReady(MachineError):
    """The mill is in manual mode, or stopped, or shows an error from before."""


class OrderRefused(MachineError):
    """The mill refuses an order: milling there would cut where the drawing does not say.

    Attributes
    ----------
    number : int
        Which, counted from 1.
    order : Order
        What it is.
    """

    def __init__(self, number: int, order: Order) -> None:
        super().__init__(f"the mill refuses order {number}, {order}; "
                         "reset it with BTN0 and find the origin again")
        self.number, self.order = number, order


class JobRefused(MachineError):
    """The mill is at another job."""


class JobHalfDone(JobRefused):
    """It has done a part of another job, which can be gone on with until a new one begins.

    Attributes
    ----------
    done : int
        The last order of that job which is done.
    """

    def __init__(self, done: int) -> None:
        super().__init__(f"the mill has done another job up to its order {done}, and that could "
                         "not be gone on with if this one began")
        self.done = done


class Phase(Enum):
    """Where a sender is."""

    ASKING = auto()  # what the mill has done so far
    OPENING = auto()  # a session
    SENDING = auto()
    CLOSING = auto()  # all orders are done
    FINISHED = auto()


class Sender:
    """Sends the orders of a job, each until it is taken, and sees them done.

    A session's number is made from the orders, so that a mill which has this job open is
    recognised: it goes on behind the last order that it took, from any sender. When all orders
    are done the session is closed. So a mill that has finished the job meanwhile is not made to do
    it twice; the next sender of the same job is. Its last eight bits are chance, so that a sender
    does not take a run that another program began meanwhile for its own.

    Whatever was milled before may have left the tool down. So what a job begins with raises it.

    Parameters
    ----------
    orders : sequence of Order
        The job, from 1 to 16 777 215 orders. See `fresa_host.jobs.begin_raised`.
    first : int
        Number of the order to begin with, counted from 1. It is one that raises the tool.
    again : bool
        Begin anew also where the mill is in the middle of this job.
    force : bool
        Begin also where the mill has done a part of another job.

    Attributes
    ----------
    paused : bool
        Send no order. Those that were taken are carried out.
    phase : Phase
    taken, done : int
        Numbers of the last order taken, and carried out.
    resumed : bool
        The mill had some of this job done when it was asked.
    heard : float or None
        When the mill was last heard.

    Raises
    ------
    ValueError
        If there is no order, or are too many, or ``first`` is none of them, or does not raise the
        tool.
    """

    def __init__(self, orders: Sequence[Order], *, first: int = 1, again: bool = False,
                 force: bool = False) -> None:
        if not 1 <= len(orders) <= LAST_NUMBER:
            raise ValueError(f"a job has 1 to {LAST_NUMBER} orders, not {len(orders)}")
        if not 1 <= first <= len(orders):
            raise ValueError(f"the first order must be from 1 to {len(orders)}, not {first}")
        if orders[first - 1].kind != Kind.UP:
            raise ValueError(f"a job begins by raising the tool, not with {orders[first - 1]}")
        self._orders, self._again = orders, again or first > 1
        self._force = force
        self._digest = zlib.crc32("\n".join(map(str, orders)).encode()) >> 8
        self._session = self._digest << 8 | random.randrange(1, RUNS)
        self._reader = AnswerReader()
        self._due = 0.0
        self._tries = CLOSING_TRIES
        self.paused = self.resumed = False
        self.phase = Phase.ASKING
        self.taken = self.done = first - 1
        self.heard: float | None = None

    @property
    def total(self) -> int:
        """Orders of the job."""
        return len(self._orders)

    @property
    def finished(self) -> bool:
        """Whether all orders are carried out, and the session is closed."""
        return self.phase is Phase.FINISHED

    def connected(self, now: float) -> None:
        """Note that there is a line, a new one maybe: what was sent over the last is not known."""
        self._reader.clear()
        self._due = now

    def wait(self, now: float) -> float:
        """Return for how many seconds there is nothing to send."""
        return max(0.0, self._due - now)

    def send(self, now: float) -> bytes:
        """Return what to send now, if it is time to."""
        if now < self._due or self.finished:
            return b""
        self._due = now + ANSWER_TIME
        if self.phase is Phase.CLOSING:
            self._tries -= 1
            if not self._tries:
                self.phase = Phase.FINISHED
            return request(Kind.OPEN)
        if self.phase is Phase.OPENING:
            return request(Kind.OPEN, self._session, self.taken)
        if self.phase is Phase.SENDING and self.taken < self.total and not self.paused:
            order = self._orders[self.taken]
            return request(order.kind, self._session, self.taken + 1, order.x, order.y)
        return request(Kind.QUERY)

    def receive(self, data: bytes, now: float) -> None:
        """Take what was heard.

        Raises
        ------
        NotReady, OrderRefused, JobRefused, JobHalfDone, WasReset
            If the job cannot go on. What was taken may still be carried out.
        """
        for answer in self._reader.feed(data):
            self.heard = now
            if not self.finished:
                self._take(answer, now)

    def _take(self, answer: Answer, now: float) -> None:
        if self.phase is Phase.ASKING:
            self._check(answer)
            self._begin(answer, now)
        elif self.phase is Phase.OPENING:
            self._check(answer)
            if answer.session == self._session:
                self.phase, self._due = Phase.SENDING, now
            else:
                self._due = now + PAUSE
        elif self.phase is Phase.CLOSING:
            if answer.session != self._session:
                self.phase = Phase.FINISHED
        else:
            self._go_on(answer, now)

    def _begin(self, answer: Answer, now: float) -> None:
        """Find out where the mill is with this job."""
        mine = answer.session and answer.session >> 8 == self._digest
        if mine and not self._again:
            self._session, self.resumed = answer.session, True
            self.phase = Phase.SENDING
            self._go_on(answer, now)
            return
        if answer.taken != answer.done:
            if not mine:
                raise JobRefused("the mill is carrying out orders of another job: wait until LD5 "
                                 "is dark, or reset it with BTN0")
            self._due = now + PAUSE  # its last orders are on their way
            return
        if answer.session and answer.done and not (mine or self._force):
            raise JobHalfDone(answer.done)
        if mine:  # another run of the same job
            self._session = self._digest << 8 | (answer.session % 256 % (RUNS - 1) + 1)
        self.phase, self._due = Phase.OPENING, now

    def _go_on(self, answer: Answer, now: float) -> None:
        if answer.session != self._session:
            if answer.manual:
                raise NotReady("the mill was put into manual mode in the middle of the job: the "
                               "origin is where the tool is now")
            raise WasReset
        if not (self.done <= answer.done <= answer.taken <= self.total):
            raise MachineError(f"the mill counts {answer.taken} orders taken and {answer.done} "
                               f"done, of {self.total}")
        self.done = answer.done
        progress = answer.taken > self.taken
        self.taken = max(self.taken, answer.taken)
        if answer.error and self.taken > self.done:
            raise OrderRefused(self.done + 1, self._orders[self.done])
        self._check(answer)
        if self.done == self.total:
            self.phase, self._due = Phase.CLOSING, now
        elif self.taken == self.total or self.paused:
            self._due = now + QUIET
        else:
            self._due = now if progress or answer.outcome is Outcome.REPORTED else now + PAUSE

    def _check(self, answer: Answer) -> None:
        if answer.stopped:
            raise NotReady("the mill is stopped: reset it with BTN0, and find the origin again")
        if answer.manual:
            raise NotReady("the mill is in manual mode: bring the tool to the origin, then put "
                           "SW7 on")
        if answer.error:
            raise NotReady("the mill shows an error: reset it with BTN0")
