"""The session of `single`: a question at a time and its answer, without the line."""

from .errors import Refused, TimedOut, WasReset
from .lines import LineSplitter
from .port import BAUD
from .session import Session, Waiting
from .single_lines import GREETING, Reply, frame

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
    """

    def __init__(self, *, name: str = "the port", baud: int = BAUD, timeout: float = 2.0) -> None:
        super().__init__(baud)
        self._name, self._timeout = name, timeout
        self._splitter = LineSplitter()
        self._stale = True  # an answer to an earlier question may come
        self._greeted = False  # without a question
        self._heard_at = 0.0
        self.target: int | None = None

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes of the line, and the time."""
        self.now = now
        if data:
            self._heard_at = now
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
        value = (yield from self.ask(frame(name, "?"))).number(name)
        if value is None:
            raise TimedOut("the machine's answer was disturbed: ask again")
        return value

    def move_to(self, position: int) -> Waiting[None]:
        """Set the set-point."""
        yield from self.ask(frame("x", position))
        self.target = position

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
            self._greeted, self.target = False, None
            raise WasReset

    def _quiet(self) -> Waiting[None]:
        """Wait for silence."""
        since, limit = self.now, self.now + SILENCE_S + self._timeout
        while self.now < (end := max(since, self._heard_at) + SILENCE_S):
            if self.now >= limit:
                raise TimedOut(f"the machine at {self._name} does not stop talking")
            yield min(end, limit)
