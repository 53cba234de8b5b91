"""`single`: one motor behind a serial line, from Python."""

import threading
import time
from typing import Self

from .errors import Refused, TimedOut, WasReset
from .lines import LineSplitter
from .port import Port
from .single_lines import GREETING, Reply, frame

__all__ = ["Single"]

#: Seconds of silence after which nothing of an old answer is still to come.
SILENCE = 0.3

#: Seconds from one look at the position to the next, while it waits.
POLL_S = 0.05


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
        self._timeout = timeout
        self._port = Port(port) if isinstance(port, str) else port
        self._lock = threading.Lock()
        self._lines = LineSplitter()
        self._late = True  # something that nobody has asked for, or asks for any more, may come
        self._target: int | None = None
        try:
            self._drain(SILENCE)  # to the greeting, if the machine was just switched on
            self._value("v")
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
        return self._value("x")

    @property
    def speed(self) -> int:
        """Speed in rpm of full steps. May be set while the motor moves, from 1 to 59 999."""
        return self._value("v")

    @speed.setter
    def speed(self, rpm: int) -> None:
        self._ask(frame("v", rpm))

    def move_to(self, position: int) -> None:
        """Send the motor to a position, 0 to 9999; do not wait until it is there.

        A motor that moves turns round at once if need be; with a ramp, when it has slowed down.
        """
        self._ask(frame("x", position))
        self._target = position

    def power(self, on: bool) -> None:
        """Give the motor power, or take it. Without, it makes no step and keeps its set-point."""
        self._ask(frame("e", int(on)))

    def help(self) -> str:
        """Give what the machine says of its commands."""
        return "\n".join(self._ask(frame("d")).lines)

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
            if self._target is None:
                return position
            if position == self._target:
                since = asked if since is None else since
                if asked - since >= settle:
                    return position
            else:
                since = None
            if since is None and end is not None and time.monotonic() >= end:
                raise TimedOut(f"the motor is at {position}, not at {self._target}, "
                               f"after {timeout:g} s")
            time.sleep(POLL_S)

    def _value(self, name: str) -> int:
        value = self._ask(frame(name, "?")).number(name)
        if value is None:
            raise TimedOut("the machine's answer was disturbed: ask again")
        return value

    def _ask(self, question: bytes) -> Reply:
        """Ask, and wait for the answer."""
        with self._lock:
            # A line by itself would be taken for a part of the answer.
            if GREETING in self._drain(SILENCE if self._late else 0):
                self._target = None
                raise WasReset
            reply, self._late = Reply(), True
            self._port.write(question)
            end = time.monotonic() + self._timeout
            while time.monotonic() < end:
                for line in self._lines.feed(self._port.read()):
                    if self._ends(reply, line):
                        self._late = False
                        return reply
        raise TimedOut(f"the machine at {self._port.name} does not answer")

    def _ends(self, reply: Reply, line: str) -> bool:
        try:
            return reply.add(line)
        except Refused:
            self._late = False
            raise
        except WasReset:
            self._target = None
            raise

    def _drain(self, silence: float) -> list[str]:
        """Give the lines that nobody asked for, until there is nothing for so many seconds."""
        lines: list[str] = []
        now = time.monotonic()
        end, limit = now + silence, now + silence + self._timeout
        while self._port.waiting or time.monotonic() < min(end, limit):
            if data := self._port.read():
                lines += self._lines.feed(data)
                end = time.monotonic() + silence
            if time.monotonic() > limit:
                raise TimedOut(f"the machine at {self._port.name} does not stop talking")
        self._lines.clear()
        return lines
