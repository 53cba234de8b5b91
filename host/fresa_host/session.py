"""Sessions without I/O: bytes that came and the time go in, bytes to send come out.

What takes several messages, or time, is an operation: a generator that gives the time at which it
goes on at the latest, and is sent each message, or None when only time has passed. So it reads like
a program that waits, and needs neither a thread nor a clock.
"""

import math
from collections.abc import Generator
from typing import Any, Generic, NamedTuple, TypeVar

from .errors import LineLost

__all__ = ["Operation", "Output", "Session", "Waiting"]

T = TypeVar("T")

#: An operation as it is written: gives deadlines in seconds, is sent messages, returns a result.
Waiting = Generator[float, Any, T]


class Output(NamedTuple):
    """Bytes to send.

    Attributes
    ----------
    data : bytes
        What to send.
    after_break : bool
        Send a break of the line first. What the port has not sent by then is lost.
    """

    data: bytes
    after_break: bool = False


class Operation(Generic[T]):
    """Something that waits for the machine.

    Attributes
    ----------
    done : bool
        It has ended, with a result or an error.
    deadline : float
        Time in seconds by which it must be resumed.
    """

    def __init__(self, steps: Waiting[T]) -> None:
        self._steps = steps
        self._ended: tuple[T] | BaseException | None = None
        self.deadline = math.inf
        self.resume(None)

    @property
    def done(self) -> bool:
        return self._ended is not None

    def resume(self, message: object) -> None:
        """Go on with a message, or None at a deadline."""
        self._advance(lambda: self._steps.send(message))

    def fail(self, error: Exception) -> None:
        """Raise an error where it waits."""
        self._advance(lambda: self._steps.throw(error))

    def cancel(self) -> None:
        """End it where it waits."""
        if not self.done:
            self._steps.close()
            self._ended = RuntimeError("the operation was cancelled")

    def result(self) -> T:
        """Return its result, or raise its error. Only when it is done."""
        if isinstance(self._ended, tuple):
            return self._ended[0]
        raise self._ended or RuntimeError("the operation is not done")

    def _advance(self, work: Any) -> None:
        if self.done:
            return
        try:
            self.deadline = work()
        except StopIteration as end:
            self._ended = (end.value,)
        except Exception as error:
            self._ended = error


class Session:
    """One end of a serial line.

    All times are in seconds of one clock, which the caller reads; they never decrease.

    Parameters
    ----------
    baud : int
        Bits a second, by which it knows when something is on the line.

    Attributes
    ----------
    now : float
        The time that was given last.
    sent_at : float
        When all that was given out will be on the line.
    lost : LineLost or None
        Why the line is gone, if it is.
    """

    def __init__(self, baud: int) -> None:
        self._baud = baud
        self._outputs: list[Output] = []
        self._operations: list[Operation[Any]] = []
        self.now = self.sent_at = 0.0
        self.lost: LineLost | None = None

    def take_outputs(self) -> list[Output]:
        """Return what to send now, in that order."""
        outputs, self._outputs = self._outputs, []
        return outputs

    @property
    def deadline(self) -> float:
        """Time by which `tick` must be called, infinite if nothing waits."""
        return min((operation.deadline for operation in self._operations), default=math.inf)

    def tick(self, now: float) -> None:
        """Note that time has passed."""
        self.now = now
        self._resume(None)

    def lose(self, error: LineLost) -> None:
        """Note that the line is gone. What waits fails with this error, and all that follows."""
        self.lost = self.lost or error
        for operation in list(self._operations):
            while not operation.done:  # each wait of it fails
                operation.fail(self.lost)
        self._operations.clear()

    def begin(self, steps: Waiting[T], now: float) -> Operation[T]:
        """Begin an operation.

        Raises
        ------
        LineLost
            If the line is gone.
        """
        if self.lost is not None:
            raise self.lost
        self.now = now
        operation = Operation(steps)
        if not operation.done:
            self._operations.append(operation)
        return operation

    def _send(self, data: bytes, *, after_break: bool = False) -> None:
        if data and self.lost is None:
            self._outputs.append(Output(data, after_break))
            self.sent_at = max(self.sent_at, self.now) + 10 * len(data) / self._baud

    def _resume(self, message: object) -> None:
        for operation in list(self._operations):
            operation.resume(message)
        self._operations = [each for each in self._operations if not each.done]

    def _until_sent(self) -> Waiting[None]:
        """Wait until all that was given out so far is on the line."""
        due = self.sent_at
        while self.now < due:
            yield due
