"""`single`: one motor behind a serial line, from Python."""

import os
import time
from contextlib import suppress
from typing import SupportsIndex

from .errors import LineLost, MachineError, Stalled, TimedOut, WasReset
from .port import Port, opened
from .serial_machine import SerialMachine
from .single_lines import frame
from .single_session import SingleSession

__all__ = ["Single"]

#: Seconds from one look at the position to the next, while it waits.
POLL_S = 0.05

#: Seconds without a step after which the motor stalls, at least: more than a ramp's first step.
STALLED_AFTER_S = 5.0

#: The same, times rpm: a turn of it, so a step of a motor with any number of them.
TURN_S = 60.0


class Single(SerialMachine[SingleSession]):
    """A motor, its position in steps and its speed in rpm of full steps.

    A machine built for half steps, which is the default, makes twice as many steps a turn
    at the same rate: its shaft turns at half of the speed.

    Every call waits for the machine's answer. All may be called from several threads. Closing lets
    go of the port; it stops nothing. A ``with`` block that an exception ends, Ctrl-C for one, stops
    the motor.

    Parameters
    ----------
    port : str, path or Port
        The serial port, such as ``/dev/ttyUSB0``; see `Port`.
    timeout : float
        Seconds that the machine has for an answer.

    Raises
    ------
    LineLost
        If the port cannot be opened, here; in all methods if it is gone or closed.
    TimedOut
        If no answer comes, here and in all methods.
    WasReset
        In all methods, once, if the machine was reset since the last call: its position is 0 now,
        and its speed that of power-up. Nothing is done then.
    Refused
        In all methods, if the machine did not obey. Then nothing has changed.
    ValueError
        In all methods, if a number is not one that the machine takes. Nothing is sent then.

    Examples
    --------
    >>> with Single("/dev/ttyUSB0") as motor:   # doctest: +SKIP
    ...     motor.speed = 60
    ...     motor.move_to(480)
    ...     motor.wait(timeout=30)
    """

    def __init__(self, port: str | os.PathLike[str] | Port, *, timeout: float = 2.0) -> None:
        port = opened(port)
        session = SingleSession(name=port.name, baud=port.baud, timeout=timeout)
        super().__init__(port, session, session.open())

    def _stop_somehow(self) -> None:
        """Stop the motor; if that is not answered, take its power."""
        try:
            self.stop()
        except WasReset:  # it stands
            pass
        except MachineError:
            with suppress(LineLost), self._lock:
                self._session.cut_power(time.monotonic())
                self._write()

    @property
    def position(self) -> int:
        """Where the motor is, in steps from where it was reset."""
        return self._run(self._session.value("x"))

    def get_position(self) -> int:
        """Return `position`."""
        return self.position

    @property
    def speed(self) -> int:
        """Speed in rpm of full steps. May be set while the motor moves, from 1 to 59 999."""
        return self._run(self._session.value("v"))

    @speed.setter
    def speed(self, rpm: int) -> None:
        self._run(self._session.ask(frame("v", rpm)))

    def move_to(self, position: SupportsIndex) -> None:
        """Send the motor to a position, 0 to 9999; do not wait until it is there.

        A motor that moves turns round at once if need be; with a ramp, when it has slowed down.
        """
        self._run(self._session.move_to(position))

    def move_by(self, steps: SupportsIndex = 1) -> None:
        """Send the motor so many steps on; do not wait until it is there.

        They count from where this object sent it last, or if it did not, from where it is.
        """
        self._run(self._session.move_by(steps))

    def home(self, timeout: float | None = None) -> int:
        """Go to position 0, where it was reset, and `wait` for it. There is no home switch."""
        self.move_to(0)
        return self.wait(timeout)

    def stop(self) -> None:
        """Stop the motor where it is, with its power on.

        It makes steps until the machine has answered where it is and was sent back there: some 30
        ms. With a ramp it slows down first.
        """
        self._run(self._session.stop())

    def is_moving(self) -> bool:
        """Return whether the motor is on its way to where this object sent it.

        One that it sent nowhere is watched for as long as a step takes, up to `STALLED_AFTER_S`.
        """
        position = self.position
        if self._session.target is not None:
            return position != self._session.target and self._session.powered is not False
        end = time.monotonic() + min(STALLED_AFTER_S, TURN_S / self.speed)
        while True:
            time.sleep(POLL_S)
            if self.position != position:
                return True
            if time.monotonic() >= end:
                return False

    def power(self, on: bool) -> None:
        """Give the motor power, or take it. Without, it makes no step and keeps its set-point."""
        self._run(self._session.power(on))

    def help(self) -> str:
        """Return what the machine says of its commands."""
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
        Stalled
            If it is not there and has no power, as this object knows, or makes no step for 5 s and
            a turn's time: another program may have taken its power.
        """
        end = None if timeout is None else time.monotonic() + timeout
        since, stands = None, _Stands()
        while True:
            asked = time.monotonic()
            position = self.position
            target = self._session.target
            if target is None:
                return position
            if position == target:
                since = asked if since is None else since
                if asked - since >= settle:
                    return position
            else:
                since = None
                if self._session.powered is False:
                    raise Stalled(f"the motor is at {position}, not at {target}, and has no "
                                  "power: power(True) first")
                if (still := stands.seconds(position)) > STALLED_AFTER_S and (
                        still > STALLED_AFTER_S + TURN_S / self.speed):
                    raise Stalled(f"the motor stands at {position}, not at {target}: it may "
                                  "have no power; power(True) gives it")
            if since is None and end is not None and time.monotonic() >= end:
                raise TimedOut(f"the motor is at {position}, not at {target}, "
                               f"after {timeout:g} s")
            time.sleep(POLL_S)

    wait_move = wait


class _Stands:
    """Measures for how long a position has not changed."""

    def __init__(self) -> None:
        self._at: int | None = None
        self._since = 0.0

    def seconds(self, position: int) -> float:
        """Take the position now; return for how many seconds it has been there."""
        now = time.monotonic()
        if position != self._at:
            self._at, self._since = position, now
        return now - self._since
