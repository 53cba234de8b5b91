"""`positioner`: three axes of a micropositioner behind a serial line, from Python."""

import math
import threading
import time
from collections.abc import Callable
from typing import NamedTuple, Self

from . import positioner_lines as lines
from .errors import LimitReached, LineLost, Refused, TimedOut
from .port import BAUD, Port
from .positioner_lines import AXES, STEPS_PER_UM, Limit, Refusal, Steps
from .positioner_link import PositionerLink

__all__ = ["Place", "Positioner"]

#: Point that `move_to` uses for itself.
SCRATCH = 7

#: Seconds after which a refusal would have come: the longest line each way, and some more.
SILENCE = 0.3

#: Reports after which it would have come, if there are any. The first may have been on its way.
REPORTS = 2


class Place(NamedTuple):
    """A place in um."""

    x: float
    y: float
    z: float

    @property
    def steps(self) -> Steps:
        """The nearest place that the motors can go to."""
        if not all(map(math.isfinite, self)):
            raise ValueError(f"a place is three numbers of um, not {tuple(self)}")
        return Steps(*(round(um * STEPS_PER_UM) for um in self))

    @classmethod
    def of(cls, steps: Steps) -> "Place":
        """Return the place of so many steps."""
        return cls(*(number / STEPS_PER_UM for number in steps))


class Positioner:
    """Three axes, their place in um and their speeds in um/s.

    The machine says nothing to what it obeys, so after each call but those named *at once* the
    other end is listened to for as long as a refusal takes to come. All methods may be called from
    several threads. Closing lets go of the port; it stops nothing.

    Parameters
    ----------
    port : str or Port
        The serial port, such as ``/dev/ttyUSB0``; see `Port`.
    timeout : float
        Seconds within which the machine must be heard. While connected it reports ten times in one.
    reported : callable, optional
        Called with each place that is reported, in steps, in a thread of its own.

    Raises
    ------
    LineLost
        If the port cannot be opened, here; in all methods if it is gone.
    Refused
        In all methods, if the machine did not obey what was asked for, or what was before *at
        once*. Then it has changed nothing.
    LimitReached
        In all methods but `stop`, `jog` and `close`, if a limit switch has ended a movement since
        the last of them.
    TimedOut
        If the machine is not heard.

    Examples
    --------
    >>> with Positioner("/dev/ttyUSB0") as positioner:   # doctest: +SKIP
    ...     positioner.connect()
    ...     positioner.velocity("x", 20)
    ...     positioner.move_to(100, 50, 0)
    ...     positioner.wait(timeout=60)
    """

    def __init__(self, port: str | Port, *, timeout: float = 2.0,
                 reported: Callable[[Steps], None] | None = None) -> None:
        self._timeout = timeout
        self._reported = reported or (lambda steps: None)
        self._changed = threading.Condition()
        self._call = threading.RLock()
        self._connected = False
        self._steps: Steps | None = None
        self._reports = 0
        self._heard_at = 0.0
        self._refusals: list[Refusal] = []
        self._limits: set[str] = set()
        self._untold: set[str] = set()
        self._target: Steps | None = None
        self._lost: LineLost | None = None
        self._link = PositionerLink(port, heard=self._hear, lost=self._lose)

    # The port

    def close(self) -> None:
        """Let go of the port. What moves goes on: `stop` first."""
        self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lose(self, error: LineLost) -> None:
        with self._changed:
            self._lost = error
            self._changed.notify_all()

    def _hear(self, said: Steps | Refusal | Limit) -> None:
        with self._changed:
            match said:
                case Steps():
                    self._steps, self._heard_at = said, time.monotonic()
                    self._reports += 1
                case Refusal():
                    self._refusals = [*self._refusals[-9:], said]
                case Limit():
                    self._limits.add(said.axis)
                    self._untold.add(said.axis)
                    self._target = None
            self._changed.notify_all()
        if isinstance(said, Steps):
            self._reported(said)

    # The machine

    def connect(self) -> Place:
        """Give the motors power, and wait for the first report; give the place."""
        with self._call:
            self._aim(None)
            with self._changed:
                seen = self._reports
                self._refusals.clear()
            self._connected = True
            try:
                self._report_after(seen)
            except Refused:  # what somebody had typed before was taken for a part of the line
                self._report_after(seen)
            return self.position

    def _report_after(self, seen: int) -> None:
        self._send(b"CONNECT\n")
        with self._changed:
            self._changed.wait_for(
                lambda: self._reports > seen or self._refusals or self._lost, self._timeout)
            if self._reports == seen and not self._refusals and self._lost is None:
                self._connected = False
                raise TimedOut(f"no machine reports at {self._link.name}: is it on?")
        self._complain()

    def disconnect(self) -> None:
        """Take the power from the motors. The machine ends all movement, and reports no more."""
        self._connected = False
        self._aim(None)
        self._do(b"DISCONNECT\n")

    @property
    def connected(self) -> bool:
        """Whether `connect` was called, and `disconnect` was not."""
        return self._connected

    @property
    def steps(self) -> Steps:
        """The place that was reported last, in steps; while connected it is a moment old."""
        with self._changed:
            if self._lost is not None:
                raise self._lost
            if self._steps is None or not self._connected:
                raise TimedOut("the machine reports only while it is connected")
            age = time.monotonic() - self._heard_at
            if age > self._timeout:
                raise TimedOut(f"the machine has not reported for {age:.1f} s: is it on?")
            return self._steps

    @property
    def position(self) -> Place:
        """The place that was reported last, in um."""
        return Place.of(self.steps)

    @property
    def limits(self) -> frozenset[str]:
        """Axes whose movement a limit switch has ended since `jog` or `move_to` moved them."""
        with self._changed:
            return frozenset(self._limits)

    def velocity(self, axis: str, um_per_second: float) -> float:
        """Set the speed of an axis, also while it moves; give the speed that it has then.

        Raises
        ------
        ValueError
            If it is not 1 to 1500 steps/s, or 0.018 to 26.4 um/s.
        """
        if not math.isfinite(um_per_second):
            raise ValueError(f"speed must be a number of um/s, not {um_per_second}")
        rate = round(um_per_second * STEPS_PER_UM)
        self._do(lines.speed(axis, rate))
        return rate / STEPS_PER_UM

    def jog(self, axis: str, way: int) -> None:
        """Move an axis up (1) or down (-1), until `stop`. At once."""
        self._begin(lines.jog(axis, way), None, axis)

    def stop(self, axis: str | None = None) -> None:
        """End the movement of an axis, or of all. At once."""
        self._aim(None)
        self._send(lines.stop(AXES if axis is None else (axis,)))

    def store(self, point: int, x: float, y: float, z: float) -> None:
        """Let the machine keep a point, 1 to 7, in um. `move_to` a place takes point 7."""
        self._do(lines.store(point, Place(x, y, z).steps))

    def move_to(self, x: float, y: float, z: float) -> None:
        """Go to a place in um, all axes at once; do not `wait` until they are there."""
        steps = Place(x, y, z).steps
        self._go(lines.store(SCRATCH, steps) + lines.go_to(SCRATCH), steps)

    def move_by(self, x: float = 0, y: float = 0, z: float = 0) -> None:
        """Go so many um from where it is."""
        here = self.steps
        way = Place(x, y, z).steps
        there = Steps(*(a + b for a, b in zip(here, way, strict=True)))
        self._go(lines.store(SCRATCH, there) + lines.go_to(SCRATCH), there)

    def _go(self, orders: bytes, there: Steps) -> None:
        with self._call:
            self._begin(orders, there, *AXES)
            try:
                self._settle(len(orders))
            except Refused:
                self._aim(None)
                raise

    def origin(self) -> None:
        """Call this place (0, 0, 0). Ends going to a place."""
        self._aim(None)
        self._do(b"ORIGIN\n")

    def call_place(self, x: float, y: float, z: float) -> None:
        """Tell the machine where it is, in um: after it was off, for instance."""
        self._aim(None)
        self._do(lines.place(Place(x, y, z).steps))

    def wait(self, timeout: float | None = None) -> Place:
        """Wait until the place is reached that it was sent to; give the place.

        Returns at once if it was sent nowhere, or sent and then stopped.

        Parameters
        ----------
        timeout : float, optional
            Seconds that it may take. None for as long as it takes.

        Raises
        ------
        TimedOut
            If it is not there by then, and goes on; or if the machine is not heard any more.
        LimitReached
            If a limit switch stops it.
        """
        end = math.inf if timeout is None else time.monotonic() + timeout
        while True:
            self._complain()
            with self._changed:
                if self._target is None or self.steps == self._target:
                    self._target = None
                    return self.position
                left = end - time.monotonic()
                if left <= 0:
                    raise TimedOut(f"after {timeout:g} s it is at {self.position}, not at "
                                   f"{Place.of(self._target)}")
                self._changed.wait(min(left, self._timeout))

    def check(self) -> None:
        """Raise what the machine has complained of since the last call."""
        self._complain()

    # What calls are made of

    def _begin(self, orders: bytes, there: Steps | None, *axes: str) -> None:
        with self._changed:
            self._limits -= set(axes)
            self._untold -= set(axes)
            self._target = there
        self._send(orders)

    def _aim(self, there: Steps | None) -> None:
        with self._changed:
            self._target = there
            self._changed.notify_all()

    def _do(self, orders: bytes) -> None:
        with self._call:
            self._send(orders)
            self._settle(len(orders))

    def _send(self, orders: bytes) -> None:
        if self._lost is not None:
            raise self._lost
        self._link.send(orders)

    def _settle(self, size: int) -> None:
        """Wait until the machine would have refused what was just sent; raise if it did."""
        time.sleep(10 * size / BAUD)
        with self._changed:
            seen = self._reports
            # Without reports, by the clock; with them by the machine's own time, if it is slow.
            patience = self._timeout if self._connected else SILENCE
            self._changed.wait_for(
                lambda: self._refusals or self._lost or self._reports >= seen + REPORTS, patience)
        self._complain()

    def _complain(self) -> None:
        with self._changed:
            if self._lost is not None:
                raise self._lost
            if self._refusals:
                reason = self._refusals.pop(0).reason
                raise Refused(reason, lines.MEANINGS.get(reason, "it does not say more"))
            if self._untold:
                axes, self._untold = frozenset(self._untold), set()
                raise LimitReached(axes)
