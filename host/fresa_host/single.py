"""`single`: one motor behind a serial line, from Python."""

import threading
import time
from typing import Self, TypeVar

from .errors import TimedOut
from .port import Port
from .session import Waiting
from .single_lines import frame
from .single_session import SingleSession

__all__ = ["Single"]

T = TypeVar("T")

#: Seconds from one look at the position to the next, while it waits.
POLL_S = 0.05

#: Reads at most of what came before a question.
STALE_READS = 16


class Single:
    """A motor, its position in steps and its speed in rpm of full steps.

    A machine built for half steps, as it is unless told otherwise, makes twice as many steps a turn
    at the same rate: its shaft turns at half of the speed.

    Every call waits for the machine's answer. All may be called from several threads.

    Parameters
    ----------
    port : str or Port
        The serial port, such as ``/dev/ttyUSB0``; see `Port`.
    timeout : float
        Seconds that the machine has for an answer.

    Raises
    ------
    LineLost
        If the port cannot be opened, here; in all methods if it is gone.
    TimedOut
        If no answer comes, here and in all methods.
    WasReset
        In all methods, once, if the machine was reset since the last call: its position is 0 now,
        and its speed that of power-up. Nothing is done then.
    Refused
        In all methods, if the machine did not obey. Then nothing has changed.

    Examples
    --------
    >>> with Single("/dev/ttyUSB0") as motor:   # doctest: +SKIP
    ...     motor.speed = 60
    ...     motor.move_to(480)
    ...     motor.wait(timeout=30)
    """

    def __init__(self, port: str | Port, *, timeout: float = 2.0) -> None:
        self._port = Port(port) if isinstance(port, str) else port
        self._session = SingleSession(name=self._port.name, baud=self._port.baud, timeout=timeout)
        self._lock = threading.Lock()
        try:
            self._run(self._session.open())
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let go of the port. The motor goes on to where it was sent."""
        self._port.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def position(self) -> int:
        """Where the motor is, in steps from where it was reset."""
        return self._run(self._session.value("x"))

    @property
    def speed(self) -> int:
        """Speed in rpm of full steps. May be set while the motor moves, from 1 to 59 999."""
        return self._run(self._session.value("v"))

    @speed.setter
    def speed(self, rpm: int) -> None:
        self._run(self._session.ask(frame("v", rpm)))

    def move_to(self, position: int) -> None:
        """Send the motor to a position, 0 to 9999; do not wait until it is there.

        A motor that moves turns round at once if need be; with a ramp, when it has slowed down.
        """
        self._run(self._session.move_to(position))

    def power(self, on: bool) -> None:
        """Give the motor power, or take it. Without, it makes no step and keeps its set-point."""
        self._run(self._session.ask(frame("e", int(on))))

    def help(self) -> str:
        """Give what the machine says of its commands."""
        return "\n".join(self._run(self._session.ask(frame("d"))).lines)

    def wait(self, timeout: float | None = None, *, settle: float = 0.1) -> int:
        """Wait until the motor is where it was sent last; give the position.

        Parameters
        ----------
        timeout : float, optional
            Seconds that it may take. None for as long as it takes.
        settle : float
            Seconds for which it is seen there. A machine with a ramp may pass a set-point that was
            given on the way, and come back: a step then takes sqrt(2 / a) s at most, with an
            acceleration of a steps/s². This is longer for any from 200 up.

        Raises
        ------
        TimedOut
            If it is not there by then. It goes on.
        """
        end = None if timeout is None else time.monotonic() + timeout
        since = None
        while True:
            asked = time.monotonic()
            position = self.position
            if self._session.target is None:
                return position
            if position == self._session.target:
                since = asked if since is None else since
                if asked - since >= settle:
                    return position
            else:
                since = None
            if since is None and end is not None and time.monotonic() >= end:
                raise TimedOut(f"the motor is at {position}, not at {self._session.target}, "
                               f"after {timeout:g} s")
            time.sleep(POLL_S)

    def _run(self, steps: Waiting[T]) -> T:
        """Carry out an operation of the session, and what came before it."""
        with self._lock:
            for _ in range(STALE_READS):
                if self._port.waiting:
                    self._session.receive(self._port.read(), time.monotonic())
            operation = self._session.begin(steps, time.monotonic())
            try:
                while True:
                    for data, _ in self._session.take_outputs():
                        self._port.write(data)
                    if operation.done:
                        return operation.result()
                    self._session.receive(self._port.read(), time.monotonic())
            finally:
                operation.cancel()
