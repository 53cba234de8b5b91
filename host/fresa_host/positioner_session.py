"""The session of a positioner: all that both ends do on its line, without the line."""

from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from . import positioner_lines as lines
from .errors import LimitReached, LineLost, Refused, TimedOut
from .positioner_errors import PositionError
from .positioner_lines import AXES, Refusal, Steps
from .positioner_place import Place
from .positioner_state import RESET_MARKER, SETTLED, ZERO, Message, PositionerState, Target
from .session import BAUD, Operation, Waiting

__all__ = ["PositionerSession"]

#: Seconds after which a refusal would have come: the longest line each way, and some more.
REFUSAL_TIMEOUT_S = 0.3

#: Times that something is sent that the line may have damaged.
TRIES = 3

#: Reports in which the machine must answer a question, or report the place that it was sent.
MOST_REPORTS = 10

#: Steps from an axis that is jogged to where a point sends it, until the order to jog comes again.
FAR = 1_000_000

#: A line that is always refused, for a reason that no other has here: so what was before is known.
FENCE = b"VEL MOT1 0\n"


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

    The machine says nothing to what it obeys: an operation has ended when a refusal would have
    come. One is begun at a time; `jog`, `stop`, `halt` and `set_speed` may be called meanwhile.

    Parameters
    ----------
    name : str
        Name of the port, for errors.
    baud : int
        Bits a second of the line.
    can_break : bool
        Whether the port can send a break.
    timeout : float
        Seconds within which the machine must be heard while it is connected.
    attended : bool
        People hold what moves, and see what is refused. Then an axis that moves, and neither was
        ordered to nor is on its way, is stopped with every report until it stands, if need be by a
        break; a jog goes on if a limit may be of the movement before; what is refused on the way to
        a point stops all axes; an order in between calls a travel off that has not departed; and
        refusals and limits are returned by `receive` alone, once the session is `connected`.

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
                 timeout: float = 2.0, attended: bool = False) -> None:
        super().__init__(name=name, baud=baud, can_break=can_break, timeout=timeout,
                         attended=attended)
        self._points: dict[int, Steps] = {}  # that the machine keeps for sure
        self._travel: Operation[None] | None = None
        self._behind = b""  # what is sent behind a travel's order to go
        self._departs_to: int | None = None

    # Operations

    def connect(self) -> Waiting[None]:
        """Yield the motors power; end at the first report."""
        self._set_target(None)
        self._sent.clear()
        self._refusals.clear()
        self._reporting = True
        seen = self.reports
        try:
            yield from self._first_report(seen)
        except Refused:  # what was typed before was taken for a part of the line
            yield from self._first_report(seen)

    def _first_report(self, seen: int) -> Waiting[None]:
        self._send(b"CONNECT\n")
        end = self.now + self._timeout
        while self.reports == seen and not self._refusals:
            if self.now >= end:
                self._reporting = False
                raise self._silent()
            yield end
        self.raise_pending()

    def disconnect(self) -> Waiting[None]:
        """Take the power from the motors; end when the machine reports no more."""
        return self._stop_if_refused(self._disconnect())

    def _disconnect(self) -> Waiting[None]:
        connected, self._reporting = self._reporting, False
        self._set_target(None)
        try:
            for _ in range(TRIES):
                seen = self.reports
                yield from self.command(b"DISCONNECT\n")
                if self.reports < seen + SETTLED:  # one may have been on its way
                    self._orders.clear()
                    return
        except Refused:
            self._reporting = connected
            raise
        self._reporting = connected
        raise TimedOut(f"the machine at {self.name} reports as if it were still connected: it may "
                       "have power")

    def command(self, order: bytes) -> Waiting[None]:
        """Send an order; end when it was not refused."""
        self._send(order)
        yield from self._settle()

    def store(self, point: int, steps: Steps) -> Waiting[None]:
        """Let the machine keep a point."""
        order = lines.store(point, steps)
        self._points.pop(point, None)  # until it is known which it is
        yield from self.command(order)
        self._points[point] = steps

    def go_to(self, point: int) -> Waiting[None]:
        """Go to a point; end when that was not refused.

        Raises
        ------
        ValueError
            If it was not stored in this session, which would not know where it is.
        """
        if point not in self._points:
            raise ValueError(f"point {point!r} has not been stored: store it first")
        self._since.clear()
        if self._depart(point, AXES):
            yield from self._stop_if_refused(self._settle(), True)

    def move_to(self, point: int, place: Target) -> Waiting[None]:
        """Go to a place, by a point of the machine. An axis whose place is None does as before.

        If the point as it was leads nowhere else than where the machine is or goes, the order to go
        is right behind the one that stores it, which may be refused; if not, it waits until that
        was not refused. Axes that are stopped or jogged before it departs do not go. When attended,
        it ends with the order to go.
        """
        self._since.clear()
        named = [axis for axis, to in zip(AXES, place, strict=True) if to is not None]
        self._clear_limits(*named)
        yield from self._stop_if_refused(self._move_to(point, place, named), True)

    def _move_to(self, point: int, place: Target, named: list[str]) -> Waiting[None]:
        try:
            steps = []
            for axis, to in zip(AXES, place, strict=True):
                steps.append((yield from self._goes_on(axis)) if to is None else to)
            there, known = Steps(*steps), self._points.get(point)
            standing = not self._orders and known == self.steps
            if known is not None and not self._attended and (standing or known == self.target):
                self._send(lines.store(point, there))
                self._points[point] = there
            else:
                yield from self.store(point, there)
            departed = self._depart(point, named)
            if self._jogged():  # what the point is to these axes is no place
                self._points.pop(point)
            if departed and not self._attended:
                yield from self._settle()
        except LimitReached:  # it was obeyed
            raise
        except BaseException:
            self._points.pop(point, None)
            self._sent.clear()
            raise

    def _jogged(self) -> list[str]:
        return [axis for axis, order in self._orders.items() if order.direction]

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
        """Return the place when two reports behind all that was sent agree for these axes.

        Raises
        ------
        TimedOut
            If they never do: it moves, or reports no more.
        """
        for _ in range(MOST_REPORTS):
            heard = yield from self._reports(1)
            self.raise_pending()
            if not heard:
                raise self._silent()
            if self._moved.isdisjoint(axes):
                return self.place(self.now)
        raise TimedOut(f"{', '.join(axes)} moves: stop it first")

    def _depart(self, point: int, named: Iterable[str]) -> bool:
        """Order axes to go that were not ordered anything since; say whether there are any."""
        going = [axis for axis in AXES if axis not in self._since]
        if going:
            self._send(lines.go_to(point) + b"".join(self._since.values()))
            self._set_target(self._points[point], *going)
            self._clear_limits(*(axis for axis in named if axis in going))
            for axis in going:
                self._sent[axis] = self._points[point][AXES.index(axis)]
        return bool(going)

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
        yield from self.command(order)

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
        steps, target = self.place(self.now), self.target
        there = Place.of(Steps(*(at if to is None else to
                                 for at, to in zip(steps, target or steps, strict=True))))
        progress = Progress(self.in_position(axes), Place.of(steps), there, target, self.reports)
        if progress.arrived:
            if self.in_position():
                self._set_target(None)
            return progress
        monitors = [order.monitor for order in self._orders.values() if order.monitor]
        if any(monitor.leads_away for monitor in monitors):
            yield from self._stop_and_verify()
            raise PositionError(f"it did not go to {there}, and was stopped at "
                                f"{Place.of(self.place(self.now))}: the line may be disturbed")
        if any(monitor.stalled for monitor in monitors):
            yield from self._stop_and_verify()
            raise PositionError(f"it stands at {Place.of(steps)}, not at {there}: the line may be "
                                "disturbed")
        return progress

    # How it is stopped

    def _stop_if_refused(self, steps: Waiting, going: bool = False) -> Waiting:
        """Stop all axes if something is refused and they were going to a target, or to be sent."""
        going = going or self.target is not None
        try:
            return (yield from steps)
        except Refused:
            if going:
                yield from self._stop_and_verify()
            raise

    def _stop_and_verify(self) -> Waiting[bool]:
        """Stop all axes, again if that is refused or one moves on, and in the end by a break.

        Says whether they stand, as far as is heard. What else is wrong the next call raises.
        """
        with suppress(LineLost):
            for _ in range(TRIES):
                self.stop(AXES, self.now)
                if (yield from self._stands()):
                    return True
            self.halt(self.now)
            return (yield from self._stands())
        return False

    def _stands(self) -> Waiting[bool]:
        yield from self._reports(SETTLED)
        before = self.steps
        yield from self._reports(1)
        refused = bool(self._refusals)
        self._refusals.clear()
        return not refused and (not self._reporting or self.steps == before)

    # How a reset is seen

    def restore(self, left: Steps) -> Waiting[bool]:
        """Connect, stop what moves, and send the machine its place if a reset has lost that.

        It has if it stands at `ZERO`, was left elsewhere, and has no `RESET_MARKER`: a reset clears
        points, and an origin that was set does not. To ask for that point moves nothing, for that
        is `ZERO` too. If another program has put it elsewhere, the speed is the lowest and the
        order to stop right behind: an axis makes a step at most.

        Parameters
        ----------
        left : Steps
            Where the machine was left.

        Returns
        -------
        bool
            Whether its place was sent to it.

        Raises
        ------
        TimedOut
            If no machine reports, or it does not stop, or the line is too bad to know.
        """
        self._reporting = self._restoring = True
        # What was typed before may be taken for the beginning of the first line.
        self._send(b"CONNECT\n" + lines.stop() + b"CONNECT\n")
        while self.steps is None:
            yield from self._next()
        yield from self._rest()
        forgot = False
        if self.steps == ZERO != left:
            forgot = yield from self._was_reset()
            yield from self._call_place(left) if forgot else self._rest()
        self._refusals.clear()
        self._restoring = False
        return forgot

    def _was_reset(self) -> Waiting[bool]:
        """Ask a machine that stands at `ZERO` for its `RESET_MARKER`."""
        slow = b"".join(lines.speed(axis, 1) for axis in AXES)
        for _ in range(TRIES):
            self._send(slow + lines.go_to(RESET_MARKER) + lines.stop() + FENCE)
            answers, quiet = [], 0
            while quiet < (SETTLED if answers else MOST_REPORTS):
                message = yield from self._next()
                if isinstance(message, Refusal):
                    answers.append(message.reason)
                quiet = quiet + 1 if isinstance(message, Steps) else 0
            if sorted(answers) in (["RANGE"], ["EMPTY", "RANGE"]):
                return "EMPTY" in answers
        raise self._disturbed()

    def _call_place(self, steps: Steps) -> Waiting[None]:
        """Send it its place, until it reports that."""
        for _ in range(TRIES):
            self._send(lines.place(steps))
            for _ in range(MOST_REPORTS):
                if (yield from self._next()) == steps:
                    return
        raise self._disturbed()

    def _disturbed(self) -> TimedOut:
        return TimedOut(f"the line to the machine at {self.name} is disturbed")

    def bring_to_rest(self) -> Waiting[None]:
        """Halt, and wait until it stands."""
        self.halt(self.now)
        self._restoring = True
        yield from self._rest()

    def _rest(self) -> Waiting[None]:
        """Stop it, and raise `TimedOut` if it is not known to stand."""
        self._refusals.clear()
        seen = self.reports
        stands = yield from self._stop_and_verify()
        if not stands:
            raise TimedOut(f"the machine at {self.name} does not stop: it moves")
        if self.reports <= seen + SETTLED:
            raise self._silent()

    # At once

    def changed_since(self, progress: Progress) -> bool:
        """Whether there was a report since, or it goes elsewhere, or something is wrong."""
        return (self.reports > progress.reports or self.target != progress.target
                or bool(self._refusals or self.lost))

    def travel(self, number: int, steps: Steps, now: float) -> None:
        """Begin to `move_to` a point; any other order before it departs calls it off."""
        self._call_off()
        marked = self._has_marker and number == RESET_MARKER
        self._behind = lines.store(RESET_MARKER, ZERO) if marked else b""
        self._departs_to = number
        self._travel = self.begin(self._send_behind(self.move_to(number, steps)), now)

    def _send_behind(self, travel: Waiting[None]) -> Waiting[None]:
        """Carry out a travel; then, or if it is called off, send what had to wait for it."""
        try:
            yield from travel
        finally:
            self._send(self._behind)

    def keep_point(self, number: int, steps: Steps, now: float) -> None:
        """Let the machine keep a point; not the `RESET_MARKER`, which `travel` stores."""
        self.now = now
        if number == RESET_MARKER:
            return
        order = lines.store(number, steps)
        if self._travel is not None and not self._travel.done and self._departs_to == number:
            self._behind += order  # it departs to what the point was
        else:
            self._send(order)

    def keep_reset_marker(self, now: float) -> None:
        """Store the `RESET_MARKER`, and again whenever it may have been lost."""
        self.now, self._has_marker = now, True
        self._send(lines.store(RESET_MARKER, ZERO))

    def call_origin(self, now: float) -> None:
        """Call this place (0, 0, 0). It goes nowhere then."""
        self.now = now
        self._call_off()
        self._set_target(None)
        self._send(b"ORIGIN\n")

    def leave(self, now: float) -> None:
        """Stop all axes and take the power from the motors, if the machine hears that."""
        self.now, self._reporting = now, False
        self._send(lines.stop() + b"DISCONNECT\n")

    @property
    def in_motion(self) -> bool:
        """Whether it goes to a point, or is about to."""
        return super().in_motion or (self._travel is not None and not self._travel.done)

    def _superseded(self) -> None:
        if self._attended:
            self._call_off()

    def _call_off(self) -> None:
        travel, self._travel = self._travel, None
        if travel is not None:
            travel.cancel()

    # How operations wait

    def _reports(self, count: int) -> Waiting[bool]:
        """Wait for reports behind all that was sent; say whether they came. A refusal ends it."""
        yield from self._until_sent()
        seen, since = self.reports, self.now
        patience = self._timeout if self._reporting else REFUSAL_TIMEOUT_S
        while self.reports < seen + count and not self._refusals:
            if self.now >= (end := max(since, self.reported_at) + patience):
                break
            yield end
        return self.reports >= seen + count

    def _settle(self) -> Waiting[None]:
        """Wait until a refusal of all that was sent would have come; raise what is wrong."""
        heard = yield from self._reports(SETTLED)
        self.raise_pending()
        if self._reporting and not heard:
            raise TimedOut(f"the machine at {self.name} reports no more: it may not have obeyed")

    def _next(self) -> Waiting[Message]:
        """Wait for the next message."""
        end = self.now + self._timeout
        while self.now < end:
            message = yield end
            if message is not None:
                return message
        raise self._silent()

    def _silent(self) -> TimedOut:
        return TimedOut(f"no machine reports at {self.name}: is it on?")
