"""`positioner`: three axes of a micropositioner behind a serial line, from Python."""

import math
import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Self, TypeVar

from . import positioner_lines as lines
from .arguments import check_number
from .errors import LineLost, TimedOut
from .port import Port, opened
from .positioner_driver import Driver
from .positioner_lines import AXES, FASTEST, STEPS_PER_UM, State, Steps
from .positioner_place import Place, steps_of
from .positioner_session import PositionerSession
from .positioner_state import Message
from .session import Waiting

__all__ = ["Positioner"]

T = TypeVar("T")

#: Point that `move_to` uses for itself.
SCRATCH = 7

ALL = "all"


class Positioner:
    """Three axes, their place in um and their speeds in um/s.

    The machine answers each line: a call ends with the answer to its own, but those named *at once*
    wait for none. If the line has lost one, the next call that waits for an answer sends it again,
    unless the axis was ordered something else since. All methods may be called from several
    threads. Closing lets go of the port; it stops nothing. A ``with`` block that an exception ends,
    Ctrl-C for one, stops all axes. Where an axis may be named, ``"all"`` is all.

    Parameters
    ----------
    port : str, path or Port
        The serial port, such as ``/dev/ttyUSB0``; see `Port`.
    timeout : float
        Seconds within which the machine must answer; it takes 0.2 s at most. While connected it
        also reports ten times in one.
    top_speed : int
        Highest speed of a motor in steps/s, as the machine was built.
    reported : callable, optional
        Called with each place that is reported, in steps, in the thread that listens to the line:
        of the methods it may only call those that are *at once*. What it raises goes to
        `threading.excepthook`, and changes nothing.

    Raises
    ------
    LineLost
        If the port cannot be opened, here; in all methods if it is gone or closed.
    Refused
        In all methods, if the machine did not obey what was requested; or what was before *at
        once*, and then the method itself does nothing. It has changed nothing, but what goes to a
        place is stopped: by `go_to` and `move_to` in any case, and by `wait`, `origin`,
        `call_place` and `disconnect` if it was going.
    LimitReached
        In all methods but `stop`, `jog` and `close`, if a limit switch has ended a movement since
        the last of them.
    TimedOut
        If the machine does not answer, although STATE was sent again; one that was built with
        ``--original`` never does.
    WasReset
        If it was reset while it was connected: it has lost its place, its speeds and its points.
        In all methods that wait for an answer, until `connect` or `disconnect`.
    ValueError
        In all methods, if a number is not one that the machine takes. Nothing is sent then.

    Examples
    --------
    >>> with Positioner("/dev/ttyUSB0") as positioner:   # doctest: +SKIP
    ...     positioner.connect()
    ...     positioner.velocity("x", 20)
    ...     positioner.move_to(100, 50, 0)
    ...     positioner.wait(timeout=60)
    """

    def __init__(self, port: str | os.PathLike[str] | Port, *, timeout: float = 2.0,
                 top_speed: int = FASTEST, reported: Callable[[Steps], None] | None = None) -> None:
        self._timeout, self._top_speed = timeout, top_speed
        self._reported = reported or (lambda steps: None)
        self._call = threading.RLock()  # held by one call: what is refused meanwhile is of that
        port = opened(port)
        self._session = PositionerSession(name=port.name, baud=port.baud, can_break=port.can_break,
                                          timeout=timeout)
        self._driver = Driver(port, self._session, self._on_message)
        self._sent_to: dict[str, tuple[int, float]] = {}  # where axes were sent, in steps and um

    def __repr__(self) -> str:
        return f"Positioner({self._session.name!r})"

    def _on_message(self, message: Message) -> None:
        if isinstance(message, Steps):
            self._reported(message)

    def _run(self, steps: Waiting[T]) -> T:
        with self._call:
            return self._driver.run(steps)

    # The port

    def close(self) -> None:
        """Let go of the port. What moves goes on: `stop` first. The machine answers no more."""
        with suppress(LineLost):
            self._driver.do(self._session.release)
            time.sleep(max(0.0, self._session.sent_at - time.monotonic()))
        self._driver.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is not None:
                with suppress(LineLost):
                    self._driver.do(self._session.halt)
        finally:
            self.close()

    # The machine

    def connect(self) -> Place:
        """Give the motors power; return the place."""
        with self._call:
            self._run(self._session.connect())
            return self.position

    def disconnect(self) -> None:
        """Take the power from the motors; the machine has confirmed that when this returns.

        It ends all movement, and reports no more.
        """
        self._run(self._session.disconnect())

    @property
    def connected(self) -> bool:
        """Whether `connect` was called, and `disconnect` was not."""
        return self._session.connected

    @property
    def steps(self) -> Steps:
        """The place that was reported last, in steps; while connected it is a moment old."""
        return self._driver.do(self._session.place)

    @property
    def position(self) -> Place:
        """The place that was reported last, in um."""
        return Place.of(self.steps)

    def get_position(self, axis: str = ALL) -> Place | float:
        """Return `position`, or what it is of an axis."""
        place = self.position
        return place if axis == ALL else place[AXES.index(_axes(axis)[0])]

    def state(self) -> State:
        """Ask for the state: connected, moving, speeds, switches, place, seconds since power-up.

        All is of one moment, behind whatever was ordered before.
        """
        return self._run(self._session.state())

    def is_moving(self, axis: str = ALL) -> bool:
        """Ask whether an axis, or any, has a movement."""
        axes = _axes(axis)
        return any(moves for name, moves in zip(AXES, self.state().moving, strict=True)
                   if name in axes)

    @property
    def limits(self) -> frozenset[str]:
        """Axes whose movement a limit switch has ended since `jog` or `move_to` moved them."""
        return self._session.limits

    def velocity(self, axis: str, um_per_second: float) -> float:
        """Set the speed of an axis, also while it moves; give the speed that it has then.

        Raises
        ------
        ValueError
            If it is not 1 step/s to `top_speed`; 1500 steps/s are 26.4 um/s.
        """
        rate = round(check_number("speed in um/s", um_per_second) * STEPS_PER_UM)
        order = lines.speed(axis, rate, self._top_speed)
        self._run(self._session.command(order))
        return rate / STEPS_PER_UM

    def get_velocity(self, axis: str = ALL) -> Place | float:
        """Ask for the speeds in um/s, or for that of an axis."""
        speeds = Place.of(Steps(*self.state().speeds))
        return speeds if axis == ALL else speeds[AXES.index(_axes(axis)[0])]

    def jog(self, axis: str, direction: int) -> None:
        """Move an axis up (1) or down (-1), until `stop`. At once. Others go on to their place."""
        self._driver.do(self._session.jog, axis, direction)

    def stop(self, axis: str | None = None) -> None:
        """End the movement of an axis, or of all. At once. Others go on to their place."""
        self._driver.do(self._session.stop, _axes(axis or ALL))

    def store(self, point: int, x: float, y: float, z: float) -> None:
        """Let the machine keep a point, 1 to 7, in um. `move_to` a place takes point 7."""
        steps = Place(x, y, z).steps
        self._run(self._session.store(point, steps))

    def go_to(self, point: int) -> None:
        """Go to a point; do not `wait` until it is reached.

        Raises
        ------
        ValueError
            If it was not stored by this object, which would not know where it is.
        """
        self._run(self._session.go_to(point))

    def move_to(self, x: float | str | None = None, y: float | None = None,
                z: float | None = None) -> None:
        """Go to a place in um, all axes at once; do not `wait` until they are there.

        An axis whose place is left out goes on as it does: to where it was sent, or by `jog`, or it
        stands. ``move_to("x", 5)`` is ``move_to(x=5)``. The axes begin to go when the machine has
        answered that it has the place.
        """
        self._move({axis: (steps_of(axis, um), um) for axis, um in _by_axis(x, y, z).items()})

    def move_by(self, x: float | str | None = None, y: float | None = None,
                z: float | None = None) -> None:
        """Go so many um on; do not `wait` until it is there.

        They count from where an axis was sent last, not rounded to steps, so that many short ways
        add up; or if it was stopped, moved by `jog` or called something else since, from where it
        is. An axis that is left out, or 0, goes on as it does, as in `move_to`.
        """
        ways = {axis: check_number(f"{axis} in um", um) for axis, um in _by_axis(x, y, z).items()}
        with self._call:
            places = {axis: self._set_point(axis) + way for axis, way in ways.items() if way}
            if places:
                self._move({axis: (steps_of(axis, um), um) for axis, um in places.items()})

    def _set_point(self, axis: str) -> float:
        """Return where an axis was sent, in um, or where it is."""
        sent, here = self._session.sent(axis), self.steps
        steps, um = self._sent_to.get(axis, (None, 0.0))
        if sent is not None and sent == steps:
            return um
        return (here[AXES.index(axis)] if sent is None else sent) / STEPS_PER_UM

    def _move(self, places: dict[str, tuple[int, float]]) -> None:
        """Go to places in steps and um."""
        with self._call:
            self._sent_to |= places
            self._run(self._session.move_to(
                SCRATCH, tuple(places[axis][0] if axis in places else None for axis in AXES)))

    def home(self, axis: str = ALL, timeout: float | None = None) -> Place:
        """Go to 0 with an axis, or all, and `wait` for it; give the place. No switch is sought."""
        axes = _axes(axis)
        self.move_to(**dict.fromkeys(axes, 0.0))
        return self._wait(axes, timeout)

    def origin(self) -> None:
        """Call this place (0, 0, 0). Ends going to a place."""
        self._run(self._session.rename(lines.ORIGIN))

    def call_place(self, x: float, y: float, z: float) -> None:
        """Tell the machine where it is, in um: after it was off, for instance."""
        self._run(self._session.rename(lines.place(Place(x, y, z).steps)))

    def set_position_reference(self, axis: str = ALL, position: float = 0) -> None:
        """Call the place of an axis, or of each, something else, in um; see `origin`.

        With one axis, all must stand.
        """
        if _axes(axis) == AXES:
            self.call_place(position, position, position)
        else:
            self._run(self._session.rename_axis(axis, steps_of(axis, position)))

    def wait_move(self, axis: str = ALL, timeout: float | None = None) -> Place:
        """Wait as `wait` does, until one axis or all are where they were sent."""
        return self._wait(_axes(axis), timeout)

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
            If it is not there by then, and goes on; or if the machine neither reports nor answers.
        LimitReached
            If a limit switch stops an axis. The others go on.
        PositionError
            If it goes elsewhere than where it was sent, or an axis stands elsewhere without a
            movement. Then all axes are stopped.
        """
        return self._wait(AXES, timeout)

    def _wait(self, axes: Sequence[str], timeout: float | None) -> Place:
        end = math.inf if timeout is None else time.monotonic() + timeout
        while True:
            progress = self._run(self._session.progress(axes))
            if progress.arrived:
                return progress.place
            left = end - time.monotonic()
            if left <= 0:
                raise TimedOut(f"after {timeout:g} s it is at {progress.place}, not at "
                               f"{progress.destination}")
            self._driver.wait(partial(self._session.changed_since, progress),
                              min(left, self._timeout))

    def check(self) -> None:
        """Wait for the answers to what was ordered *at once*; raise refusals, and limits.

        What the line has lost is sent again.
        """
        self._run(self._session.check())


def _axes(axis: str) -> tuple[str, ...]:
    """Return the axes that a name stands for."""
    if axis == ALL:
        return AXES
    if axis not in AXES:
        raise ValueError(f"axis must be x, y, z or all, not {axis!r}")
    return (axis,)


def _by_axis(x: float | str | None, y: float | None, z: float | None) -> dict[str, float]:
    """Return what is given for axes: as x, y and z, or as an axis and its number."""
    if isinstance(x, str):
        if y is None or z is not None:
            raise ValueError(f"with an axis, {x!r}, goes one number")
        return {axis: y for axis in _axes(x)}
    given: dict[str, float] = {
        axis: um for axis, um in zip(AXES, (x, y, z), strict=True) if um is not None}
    if not given:
        raise ValueError("say where to, for an axis at least")
    return given
