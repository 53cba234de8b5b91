"""The session of a positioner: all that both ends do on its line, without the line."""

import math
from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from . import positioner_lines as lines
from .errors import Refused, TimedOut
from .positioner_answers import Line
from .positioner_errors import PositionError
from .positioner_lines import AXES, Refusal, State, Steps
from .positioner_place import Place
from .positioner_state import PositionerState, Target
from .session import BAUD, Waiting

__all__ = ["PositionerSession"]

#: Seconds of silence, and reports behind a line, after which its answer is lost. It comes within
#: two reports; a simulation may be slow.
ANSWER_TIMEOUT_S, ANSWER_REPORTS = 1.0, 5

#: Times that something is sent that the line may have damaged.
TRIES = 3

#: Steps from an axis that is jogged to where a point sends it, until the order to jog comes again.
FAR = 1_000_000


class Progress(NamedTuple):
    """What was known of the way to a target.

    Attributes
    ----------
    arrived : bool
        It is there, or has no target.
    place, destination : Place
        Where it is, and where it goes to.
    target : Target or None
        The same in steps.
    reports : int
        Reports by then.
    """

    arrived: bool
    place: Place
    destination: Place
    target: Target | None
    reports: int


class PositionerSession(PositionerState):
    """One positioner on a line. Bytes and times go in, orders and messages come out.

    The machine answers each line, and an operation ends with the answer to its own. Where answers
    were lost, the answer to ``STATE`` tells which; then an order is sent again. One operation is
    begun at a time; `jog`, `stop` and `halt` may be called meanwhile.

    Parameters
    ----------
    name : str
        Name of the port, for errors.
    baud : int
        Bits a second of the line.
    can_break : bool
        Whether the port can send a break.
    timeout : float
        Seconds within which the machine must answer or report.

    Attributes
    ----------
    connected : bool
        The machine has power and should report.
    steps : Steps or None
        The place that was reported last.
    reported_at : float
        When that was.
    reports, halts : int
        Reports so far, and times that all movement was ended at once.
    """

    def __init__(self, *, name: str = "the port", baud: int = BAUD, can_break: bool = False,
                 timeout: float = 2.0) -> None:
        super().__init__(name=name, baud=baud, can_break=can_break, timeout=timeout)
        self._points: dict[int, Steps] = {}  # that the machine keeps for sure

    # Answers

    def fence(self) -> Waiting[State]:
        """Return the machine's state. Each line before has been answered then, or is lost.

        Raises
        ------
        TimedOut
            If there is no answer.
        WasReset
            If it was reset since it was connected.
        """
        state = yield from self._state()
        if self._reporting and not state.connected:
            state = yield from self._state()  # the first may be damaged
            if not state.connected:
                raise self._was_reset()
        return state

    def _state(self) -> Waiting[State]:
        end = self.now + self._timeout
        while True:
            query = self._unanswered.query
            line = query or self._submit(self._unanswered.query_lines)[-1]
            yield from self._ended(line, end)
            if query is None and isinstance(line.answer, State):
                return line.answer
            if not line.ended:
                self._unanswered.give_up_query()
            if self.now >= end:
                raise TimedOut(f"no machine answers at {self.name}: is it on, and built without "
                               "--original?")

    def _ended(self, line: Line, end: float = math.inf) -> Waiting[None]:
        """Wait until a line is answered, or should have been."""
        end = min(end, line.due + self._timeout)
        while not line.ended and self.reports < line.reports + ANSWER_REPORTS and self.now < (
                due := min(end, max(line.due, self._received_at) + ANSWER_TIMEOUT_S)):
            yield due

    def _drained(self) -> Waiting[None]:
        """Wait until each line before is answered, or is lost, and the next can be attributed.

        Raises
        ------
        TimedOut
            If the line is too bad for that.
        """
        line, end = self._unanswered.last, self.now + self._timeout
        while self._unanswered.in_doubt or not (line is None or line.ended):
            if self.now >= end:
                raise self._disturbed()
            if line is not None and not self._unanswered.in_doubt:
                yield from self._ended(line)
            if line is None or not line.ended:
                yield from self.fence()

    def _repeat_lost(self, axes: Iterable[str] = AXES) -> Waiting[None]:
        """Send again what axes were ordered at once, until each has been answered."""
        if self._attended:  # whose state is verified
            return
        if not self._answers:
            yield from self._open()
        for _ in range(TRIES):
            yield from self._drained()
            if not (lost := self._lost(axes)):
                return
            for order in lost:
                order.line = self._submit_at_once(order.line.order)
        raise self._disturbed()

    def _settled(self, axes: Iterable[str]) -> Waiting[State]:
        """Return the machine's state, when nothing that these axes were ordered at once is lost."""
        state = yield from self.fence()
        if self._answers and self._lost(axes):
            yield from self._repeat_lost(axes)
            state = yield from self.fence()
        return state

    def _obeyed(self, line: Line) -> Waiting[bool]:
        """Wait for the answer to a line; return whether it was obeyed, or False if it is lost.

        Raises
        ------
        Refused
            If it was refused.
        """
        yield from self._ended(line)
        if not line.ended:
            yield from self.fence()
        if isinstance(line.answer, Refusal):
            raise self._error(line.answer)
        return line.answer is not None

    def _obey(self, order: bytes) -> Waiting[None]:
        """Send an order until it is obeyed."""
        if not self._answers:
            yield from self._open()
        for _ in range(TRIES):
            yield from self._drained()
            self._raise_refused()
            (line,) = self._submit(order)
            if (yield from self._obeyed(line)):
                return
        raise self._disturbed()

    def _disturbed(self) -> TimedOut:
        return TimedOut(f"the line to the machine at {self.name} is disturbed: it may not have "
                        "obeyed")

    # Operations

    def connect(self) -> Waiting[None]:
        """Give the motors power; end when the place is known."""
        self._orders.clear()  # nothing moves before that
        self._sent.clear()
        self._reporting = False
        yield from self._open()
        self._refusals.clear()
        yield from self._power()

    def _open(self) -> Waiting[State]:
        """Find the machine, and have it answer."""
        self._unanswered.give_up()
        state = yield from self.fence()
        self._answers = True
        yield from self._obey(lines.ACK)
        return state

    def _power(self) -> Waiting[None]:
        yield from self._obey(lines.CONNECT)
        self._reporting = True
        yield from self.fence()

    def disconnect(self) -> Waiting[None]:
        """Take the power from the motors; end when STATE reports none."""
        return self._stop_if_refused(self._disconnect())

    def _disconnect(self) -> Waiting[None]:
        self._set_target(None)
        connected, self._reporting = self._reporting, False
        try:
            for _ in range(TRIES):
                try:
                    yield from self._obey(lines.DISCONNECT)
                except TimedOut:  # one that was reset answers STATE only
                    if (yield from self.fence()).connected:
                        raise
                if not (yield from self.fence()).connected:
                    connected = False
                    self._orders.clear()
                    return
            raise TimedOut(f"the machine at {self.name} is still connected: it may have power")
        finally:
            self._reporting = connected

    def state(self) -> Waiting[State]:
        """Return the machine's state, behind all that was ordered."""
        state = yield from self._settled(AXES)
        self.raise_pending()
        return state

    def check(self) -> Waiting[None]:
        """Wait for the answers to all that was sent; raise what is wrong."""
        yield from self._repeat_lost()
        self.raise_pending()

    def command(self, order: bytes) -> Waiting[None]:
        """Send an order; end when it was obeyed."""
        yield from self._repeat_lost()
        yield from self._obey(order)
        self.raise_pending()

    def store(self, point: int, steps: Steps) -> Waiting[None]:
        """Let the machine keep a point."""
        yield from self._repeat_lost()
        yield from self._store(point, steps)
        self.raise_pending()

    def _store(self, point: int, steps: Steps) -> Waiting[None]:
        order = lines.store(point, steps)
        self._points.pop(point, None)  # until it is known which it is
        yield from self._obey(order)
        self._points[point] = steps

    def go_to(self, point: int) -> Waiting[None]:
        """Go to a point; end when that was obeyed.

        Raises
        ------
        ValueError
            If it was not stored in this session, which would not know where it is.
        """
        if point not in self._points:
            raise ValueError(f"point {point!r} has not been stored: store it first")
        self._since.clear()
        yield from self._stop_if_refused(self._depart(point, AXES), True)
        self.raise_pending()

    def move_to(self, point: int, place: Target) -> Waiting[None]:
        """Go to a place, by a point of the machine. An axis whose place is None does as before.

        It is ordered to go when it has obeyed to store the point. Axes that are stopped or jogged
        before that do not go.
        """
        self._since.clear()
        named = [axis for axis, to in zip(AXES, place, strict=True) if to is not None]
        self._clear_limits(*named)
        yield from self._stop_if_refused(self._move_to(point, place, named), True)
        self.raise_pending()

    def _move_to(self, point: int, place: Target, named: list[str]) -> Waiting[None]:
        try:
            steps = []
            for axis, to in zip(AXES, place, strict=True):
                steps.append((yield from self._goes_on(axis)) if to is None else to)
            yield from self._store(point, Steps(*steps))
            yield from self._depart(point, named)
        except BaseException:
            self._points.pop(point, None)
            self._sent.clear()
            raise
        if any(order.direction for order in self._orders.values()):
            self._points.pop(point)  # what it is to the axis that is jogged is no place

    def _goes_on(self, axis: str) -> Waiting[int]:
        """Return a place for an axis, as part of a point, by which it goes on as it does.

        Where it was sent, or stands; far ahead if it is jogged, which it is again right behind.
        """
        if (order := self._orders.get(axis)) is not None and order.direction:
            self._since[axis] = lines.jog(axis, order.direction)
            return self.place(self.now)[AXES.index(axis)] + FAR * order.direction
        if (sent := self._sent.get(axis)) is not None:
            return sent
        return (yield from self._standing([axis]))[AXES.index(axis)]

    def _standing(self, axes: Iterable[str]) -> Waiting[Steps]:
        """Return the place, if these axes stand.

        Raises
        ------
        TimedOut
            If they do not.
        """
        state = yield from self._settled(axes)
        self._raise_refused()
        if moving := [axis for axis in axes if state.moving[AXES.index(axis)]]:
            raise TimedOut(f"{', '.join(moving)} moves: stop it first")
        return state.steps

    def _depart(self, point: int, named: Iterable[str]) -> Waiting[None]:
        """Order axes to go that were not ordered anything since."""
        for _ in range(TRIES):
            yield from self._drained()
            self._raise_refused()
            if not (going := [axis for axis in AXES if axis not in self._since]):
                return
            line, *_ = self._submit(lines.go_to(point) + b"".join(self._since.values()))
            steps = self._points[point]
            self._set_target(steps, *going, line=line)
            self._clear_limits(*(axis for axis in named if axis in going))
            self._sent |= {axis: steps[AXES.index(axis)] for axis in going}
            if (yield from self._obeyed(line)):
                return
        raise self._disturbed()

    def rename(self, order: bytes) -> Waiting[None]:
        """Send an order that calls the place something else. It goes nowhere then."""
        return self._stop_if_refused(self._rename(order))

    def rename_axis(self, axis: str, steps: int) -> Waiting[None]:
        """Call the place of an axis something else, when all axes stand."""
        place = yield from self._standing(AXES)
        yield from self.rename(lines.place(place._replace(**{axis: steps})))

    def _rename(self, order: bytes) -> Waiting[None]:
        self._set_target(None)
        self._sent.clear()
        yield from self._repeat_lost()
        yield from self._obey(order)
        yield from self.fence()  # the place that is known is the new one then
        self.raise_pending()

    def progress(self, axes: Iterable[str] = AXES) -> Waiting[Progress]:
        """Look whether the target is reached, by these axes at least.

        Raises
        ------
        PositionError
            If an axis goes or stands elsewhere; all axes are stopped then.
        """
        return self._stop_if_refused(self._progress(axes))

    def _progress(self, axes: Iterable[str]) -> Waiting[Progress]:
        self.raise_pending()
        if self.stale(self.now):
            yield from self.fence()  # one that was reset does not report
        steps, target = self.place(self.now), self.target
        there = Place.of(Steps(*(at if to is None else to
                                 for at, to in zip(steps, target or steps, strict=True))))
        progress = Progress(self.in_position(axes), Place.of(steps), there, target, self.reports)
        if progress.arrived:
            if self.in_position():
                self._set_target(None)
            return progress
        monitors = {axis: order.monitor for axis, order in self._orders.items() if order.monitor}
        if any(monitor.leads_away for monitor in monitors.values()):
            yield from self._stop_and_verify()
            raise PositionError(f"it did not go to {there}, and was stopped at "
                                f"{Place.of(self.place(self.now))}: the line may be disturbed")
        if any(monitor.stands for monitor in monitors.values()):
            state = yield from self.fence()
            for axis, monitor in monitors.items():
                if state.moving[AXES.index(axis)]:
                    monitor.resume()
            if any(monitor.stands for monitor in monitors.values()):
                yield from self._stop_and_verify()
                raise PositionError(f"it stands at {Place.of(steps)}, not at {there}: the line may "
                                    "be disturbed")
        return progress

    # How it is stopped

    def _stop_if_refused(self, steps: Waiting, going: bool = False) -> Waiting:
        """Stop all axes if something is refused and they were going to a target, or to be sent."""
        going = going or self.target is not None
        try:
            return (yield from steps)
        except Refused:
            if going and not self._attended:
                yield from self._stop_and_verify()
            raise

    def _stop_and_verify(self) -> Waiting[bool]:
        """Stop all axes, again if one moves on, and in the end by a break.

        Returns whether STATE reports that they stand. What else is wrong the next call raises.
        """
        with suppress(TimedOut):
            for _ in range(TRIES):
                self._orders.clear()
                self._sent.clear()
                self._submit(lines.stop())
                if not any((yield from self.fence()).moving):
                    return True
        self.halt(self.now)
        with suppress(TimedOut):
            return not any((yield from self.fence()).moving)
        return False

    # At once

    def changed_since(self, progress: Progress) -> bool:
        """Whether there was a report since, or it goes elsewhere, or something is wrong."""
        return (self.reports > progress.reports or self.target != progress.target
                or bool(self._refusals or self.lost))

    def release(self, now: float) -> None:
        """Have the machine answer no more, as after power-up."""
        self.now = now
        if self._answers:
            self._answers = False
            self._submit(lines.ACK_OFF)
