"""The session of `single`: a question at a time and its answer, without the line."""

import operator
from typing import SupportsIndex

from .arguments import check_whole
from .errors import Refused, TimedOut, WasReset
from .lines import LineSplitter
from .session import BAUD, Session, Waiting
from .single_lines import GREETING, HIGHEST, Reply, frame, question

__all__ = ["SILENCE_S", "SingleSession"]

#: Seconds of silence after which nothing of an old answer is still to come.
SILENCE_S = 0.3


class SingleSession(Session):
    """One motor on a line. All operations raise what `fresa_host.Single` does.

    Parameters
    ----------
    name : str
        Name of the port, for errors.
    baud : int
        Bits a second of the line.
    timeout : float
        Seconds that the machine has for an answer.

    Attributes
    ----------
    target : int or None
        The set-point that it was sent to since it was reset.
    powered : bool or None
        Whether the motor has power; None if no answer since has said so.
    """

    def __init__(self, *, name: str = "the port", baud: int = BAUD, timeout: float = 2.0) -> None:
        super().__init__(baud)
        self._name, self._timeout = name, timeout
        self._splitter = LineSplitter()
        self._stale = True  # an answer to an earlier question may come
        self._greeted = False  # without a question
        self._received_at = 0.0
        self.target: int | None = None
        self.powered: bool | None = None

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes of the line, and the time."""
        self.now = now
        if data:
            self._received_at = now
        for line in self._splitter.feed(data):
            self._greeted |= line == GREETING
            self._resume(line)
        self._resume(None)

    def open(self) -> Waiting[None]:
        """Find the machine. It may have been switched on just before."""
        yield from self._quiet()
        self._stale = self._greeted = False
        yield from self.value("v")

    def value(self, name: str) -> Waiting[int]:
        """Ask for the position (``x``) in steps, or the speed (``v``) in rpm of full steps."""
        value = (yield from self.ask(question(name))).number(name)
        if value is None:
            raise TimedOut("the machine's answer was disturbed: ask again")
        return value

    def move_to(self, position: SupportsIndex) -> Waiting[None]:
        """Set the set-point."""
        yield from self.ask(frame("x", position))
        self.target = operator.index(position)

    def move_by(self, steps: SupportsIndex) -> Waiting[None]:
        """Set the set-point so many steps on from where it is, or from the position."""
        way = check_whole("steps", steps, -HIGHEST, HIGHEST)
        base = (yield from self.value("x")) if self.target is None else self.target
        yield from self.move_to(base + way)

    def stop(self) -> Waiting[None]:
        """Set the set-point to where the motor is."""
        yield from self.move_to((yield from self.value("x")))

    def power(self, on: bool) -> Waiting[None]:
        """Give the motor power, or take it."""
        order = frame("e", on)
        self.powered = None
        yield from self.ask(order)
        self.powered = bool(on)

    def cut_power(self, now: float) -> None:
        """Take the power at once; its answer is taken for an old one."""
        self.now, self.powered, self._stale = now, None, True
        self._send(frame("e", 0))

    def ask(self, question: bytes) -> Waiting[Reply]:
        """Send a frame, when no old answer can come any more; return its answer."""
        if self._stale:  # a line of it would be taken for a part of the answer
            yield from self._quiet()
        self._splitter.clear()
        self._check_reset()
        reply, self._stale = Reply(), True
        self._send(question)
        end = self.now + self._timeout
        while self.now < end:
            line = yield end
            if line is None:
                continue
            self._check_reset()
            try:
                ended = reply.add(line)
            except Refused:
                self._stale = False
                raise
            if ended:
                self._stale = False
                return reply
        raise TimedOut(f"the machine at {self._name} does not answer")

    def _check_reset(self) -> None:
        if self._greeted:
            self._greeted, self.target, self.powered = False, None, None
            raise WasReset

    def _quiet(self) -> Waiting[None]:
        """Wait for silence."""
        since, limit = self.now, self.now + SILENCE_S + self._timeout
        while self.now < (end := max(since, self._received_at) + SILENCE_S):
            if self.now >= limit:
                raise TimedOut(f"the machine at {self._name} does not stop talking")
            yield min(end, limit)
