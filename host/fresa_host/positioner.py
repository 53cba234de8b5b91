"""`positioner`: three axes of a micropositioner behind a serial line, from Python."""

import math
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from . import positioner_lines as lines
from .errors import LineLost, PositionError, Refused, TimedOut
from .heard import SETTLED, reached
from .place import Place
from .port import Port
from .positioner_lines import AXES, FASTEST, STEPS_PER_UM, Steps
from .positioner_talk import TRIES, PositionerTalk
from .positioner_way import Ways

__all__ = ["Positioner"]

#: Point that `move_to` uses for itself.
SCRATCH = 7


class Positioner:
    """Three axes, their place in um and their speeds in um/s.

    The machine says nothing to what it obeys, so after each call but those named *at once* the
    other end is listened to for as long as a refusal takes to come. All methods may be called from
    several threads. Closing lets go of the port; it stops nothing. A ``with`` block that an
    exception ends, Ctrl-C for one, stops all axes.

    Parameters
    ----------
    port : str or Port
        The serial port, such as ``/dev/ttyUSB0``; see `Port`.
    timeout : float
        Seconds within which the machine must be heard. While connected it reports ten times in one.
    top_speed : int
        Highest speed of a motor in steps/s, as the machine was built.
    reported : callable, optional
        Called with each place that is reported, in steps, in the thread that listens to the line:
        of the methods it may only call those that are *at once*. What it raises is told by
        `threading.excepthook`, and changes nothing.

    Raises
    ------
    LineLost
        If the port cannot be opened, here; in all methods if it is gone.
    Refused
        In all methods, if the machine did not obey what was asked for, or what was before *at
        once*. Then it has changed nothing, but what goes to a place is stopped: by `go_to` and
        `move_to` in any case, and by `wait`, `origin`, `call_place` and `disconnect` if it was
        going.
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

    def __init__(self, port: str | Port, *, timeout: float = 2.0, top_speed: int = FASTEST,
                 reported: Callable[[Steps], None] | None = None) -> None:
        self._timeout, self._top_speed = timeout, top_speed
        self._points: dict[int, Steps] = {}
        self._talk = PositionerTalk(port, timeout, reported)
        self._call, self._heard, self._link = self._talk.call, self._talk.heard, self._talk.link

    # The port

    def close(self) -> None:
        """Let go of the port. What moves goes on: `stop` first."""
        self._link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is not None:
                with suppress(LineLost):
                    self._link.halt()
                    time.sleep(20 * len(lines.stop()) / self._link.baud)  # until it is on the line
        finally:
            self.close()

    # The machine

    def connect(self) -> Place:
        """Give the motors power, and wait for the first report; give the place."""
        with self._call:
            self._heard.aim(None)
            seen = self._heard.reports
            self._heard.refusals.clear()
            self._talk.connected = True
            try:
                self._report_after(seen)
            except Refused:  # what somebody had typed before was taken for a part of the line
                self._report_after(seen)
            return self.position

    def _report_after(self, seen: int) -> None:
        self._talk.send(b"CONNECT\n")
        if not self._heard.wait_for_reports(seen + 1, self._timeout):
            self._talk.connected = False
            raise TimedOut(f"no machine reports at {self._link.name}: is it on?")

    def disconnect(self) -> None:
        """Take the power from the motors. The machine ends all movement, and reports no more."""
        with self._call, self._talk.standing_if_refused():
            connected, self._talk.connected = self._talk.connected, False
            self._heard.aim(None)
            try:
                for _ in range(TRIES):
                    seen = self._heard.reports
                    self._talk.do(b"DISCONNECT\n")
                    if self._heard.reports < seen + SETTLED:  # one may have been on its way
                        return
            except Refused:
                self._talk.connected = connected
                raise
            self._talk.connected = connected
            raise TimedOut(f"the machine at {self._link.name} reports as if it were still "
                           "connected: nobody knows whether it has power")

    @property
    def connected(self) -> bool:
        """Whether `connect` was called, and `disconnect` was not."""
        return self._talk.connected

    @property
    def steps(self) -> Steps:
        """The place that was reported last, in steps; while connected it is a moment old."""
        steps, age = self._heard.last()
        if steps is None or not self._talk.connected:
            raise TimedOut("the machine reports only while it is connected")
        if age > self._timeout:
            raise TimedOut(f"the machine has not reported for {age:.1f} s: is it on?")
        return steps

    @property
    def position(self) -> Place:
        """The place that was reported last, in um."""
        return Place.of(self.steps)

    @property
    def limits(self) -> frozenset[str]:
        """Axes whose movement a limit switch has ended since `jog` or `move_to` moved them."""
        return self._heard.limits

    def velocity(self, axis: str, um_per_second: float) -> float:
        """Set the speed of an axis, also while it moves; give the speed that it has then.

        Raises
        ------
        ValueError
            If it is not 1 step/s to `top_speed`; 1500 steps/s are 26.4 um/s.
        """
        if not math.isfinite(um_per_second):
            raise ValueError(f"speed must be a number of um/s, not {um_per_second}")
        rate = round(um_per_second * STEPS_PER_UM)
        self._talk.do(lines.speed(axis, rate, self._top_speed))
        return rate / STEPS_PER_UM

    def jog(self, axis: str, way: int) -> None:
        """Move an axis up (1) or down (-1), until `stop`. At once. Others go on to their place."""
        self._talk.jog(axis, lines.jog(axis, way))

    def stop(self, axis: str | None = None) -> None:
        """End the movement of an axis, or of all. At once. Others go on to their place."""
        self._talk.stop(AXES if axis is None else (axis,))

    def store(self, point: int, x: float, y: float, z: float) -> None:
        """Let the machine keep a point, 1 to 7, in um. `move_to` a place takes point 7."""
        self._store(point, Place(x, y, z).steps)

    def _store(self, point: int, steps: Steps) -> None:
        order = lines.store(point, steps)
        with self._call:
            self._points.pop(point, None)  # while nobody knows which it is
            self._talk.do(order)
            self._points[point] = steps

    def go_to(self, point: int) -> None:
        """Go to a point; do not `wait` until it is reached.

        Raises
        ------
        ValueError
            If it was not stored by this object, which would not know where it is.
        """
        with self._call:
            if point not in self._points:
                raise ValueError(f"point {point!r} has not been stored: store it first")
            self._talk.begin()
            self._talk.go(lines.go_to(point), self._points[point])

    def move_to(self, x: float, y: float, z: float) -> None:
        """Go to a place in um, all axes at once; do not `wait` until they are there."""
        self._go_anywhere(Place(x, y, z).steps)

    def move_by(self, x: float = 0, y: float = 0, z: float = 0) -> None:
        """Go so many um from where it is."""
        here = self.steps
        way = Place(x, y, z).steps
        self._go_anywhere(Steps(*(a + b for a, b in zip(here, way, strict=True))))

    def _go_anywhere(self, there: Steps) -> None:
        with self._call:
            self._talk.begin()
            self._heard.forgive(*AXES)
            with self._talk.standing_if_refused(True):
                self._store(SCRATCH, there)  # or it would go to the old point if that is refused
            self._talk.go(lines.go_to(SCRATCH), there)

    def origin(self) -> None:
        """Call this place (0, 0, 0). Ends going to a place."""
        self._rename(b"ORIGIN\n")

    def call_place(self, x: float, y: float, z: float) -> None:
        """Tell the machine where it is, in um: after it was off, for instance."""
        self._rename(lines.place(Place(x, y, z).steps))

    def _rename(self, order: bytes) -> None:
        with self._call, self._talk.standing_if_refused():
            self._heard.aim(None)
            self._talk.do(order)

    def wait(self, timeout: float | None = None) -> Place:
        """Wait until the place is reached that it was sent to; give the place.

        Axes that were stopped or moved by `jog` since, or stopped by a limit switch, may be
        anywhere. Returns at once if that is all of them, or it was sent nowhere.

        Parameters
        ----------
        timeout : float, optional
            Seconds that it may take. None for as long as it takes.

        Raises
        ------
        TimedOut
            If it is not there by then, and goes on; or if the machine is not heard any more.
        LimitReached
            If a limit switch stops an axis. The others go on.
        PositionError
            If it goes elsewhere than where it was sent, or an axis has stood elsewhere for 20 s,
            which one that takes up much play slowly does, too. Then all axes are stopped.
        """
        end = math.inf if timeout is None else time.monotonic() + timeout
        ways = Ways(())
        while True:
            with self._call:  # what is refused then is another call's
                with self._talk.standing_if_refused():
                    self._heard.complain()
                target, seen, steps = self._heard.target, self._heard.reports, self.steps
                if target is None or reached(steps, target):
                    self._heard.aim(None)
                    return Place.of(steps)
                there = Place.of(Steps(*(at if to is None else to
                                         for at, to in zip(steps, target, strict=True))))
                ways = ways if ways.target == target else Ways(target)
                ways.hear(steps)
                if ways.lead_away:
                    self._talk.stand()
                    raise PositionError(f"it did not go to {there}, and was stopped at "
                                        f"{self.position}: "
                                 "the line may be disturbed")
                if ways.stand:
                    self._talk.stand()
                    raise PositionError(f"it stands at {Place.of(steps)}, not at {there}: the "
                                        f"line may be "
                                 "disturbed")
            left = end - time.monotonic()
            if left <= 0:
                raise TimedOut(f"after {timeout:g} s it is at {Place.of(steps)}, not at {there}")
            self._heard.wait(target, seen, min(left, self._timeout))

    def check(self) -> None:
        """Raise what the machine has complained of since the last call."""
        with self._call:
            self._heard.complain()
