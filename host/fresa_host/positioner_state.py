"""What a positioner was ordered and what it answers and reports: the state of its session."""

from collections.abc import Iterable
from dataclasses import dataclass

from . import positioner_lines as lines
from .axis_monitor import AxisMonitor
from .errors import LimitReached, Refused, TimedOut, WasReset
from .lines import LineSplitter
from .positioner_answers import Line, Unanswered
from .positioner_lines import (
    AXES,
    DISCONNECTED,
    MEANINGS,
    Limit,
    Ok,
    Refusal,
    State,
    Steps,
    read_line,
)
from .session import Session

__all__ = ["Message", "PositionerState", "Target"]

#: A message of the machine.
Message = Steps | Refusal | Limit

#: Where each axis is going to; None for one that may be anywhere.
Target = tuple[int | None, ...]

#: Refusals that are kept until a call raises them.
MOST_REFUSALS = 10

#: Seconds without a report after which what was reported is no longer true.
STALE_AFTER = 0.38

#: Seconds until a break is on the line.
HALT_S = 0.1


@dataclass
class _AxisOrder:
    """What an axis was ordered last: to move until it is stopped, or to a target.

    Attributes
    ----------
    line : Line
        The order.
    direction : int
        Which way it moves; 0 if it goes to a target.
    monitor : AxisMonitor or None
        Its way to the target.
    ended : bool
        It has arrived, or will not.
    repeated : bool
        It was sent again, for a limit that may be of the movement before.
    """

    line: Line
    direction: int = 0
    monitor: AxisMonitor | None = None
    ended: bool = False
    repeated: bool = False

    def end(self) -> None:
        """Note that the axis is to stand."""
        self.direction, self.monitor, self.ended = 0, None, True

    def update(self, at: int) -> bool:
        """Take a report; return whether the axis has ended its way by it, or may have."""
        if self.ended or self.monitor is None or not self.line.ended:
            return False
        self.monitor.update(at)
        self.ended = at == self.monitor.target or self.monitor.leads_away
        return self.ended or self.monitor.stands


class PositionerState(Session):
    """What was ordered, what was received, and what is sent at once. See `PositionerSession`."""

    _attended = False  # see `AttendedSession`

    def __init__(self, *, name: str, baud: int, can_break: bool, timeout: float) -> None:
        super().__init__(baud)
        self.name, self._timeout, self._can_break = name, timeout, can_break
        self._splitter = LineSplitter()
        self._unanswered = Unanswered()
        self._answers = False  # the machine answers
        self._orders: dict[str, _AxisOrder] = {}
        self._since: dict[str, bytes] = {}  # what axes were ordered since a travel began
        self._refusals: list[Refusal] = []
        self._limits: set[str] = set()
        self._pending_limits: set[str] = set()
        self._unexpected: set[str] = set()  # axes that moved without an order in the last report
        self._unverified = False  # whether what is ordered to stand does, if attended
        self._sent: dict[str, int] = {}  # where axes were sent, unless ordered something since
        self._reporting = self._restoring = False
        self.steps: Steps | None = None
        self.reported_at = self._received_at = 0.0
        self.reports = self.halts = 0
        self.at_rest = False

    # What is known

    @property
    def connected(self) -> bool:
        """Whether the machine has power and should report."""
        return self._reporting and not self._restoring and self.lost is None

    def place(self, now: float) -> Steps:
        """Return the place that was reported last.

        Raises
        ------
        LineLost
            If the line is gone.
        TimedOut
            If it is not connected, or the report is older than the timeout.
        """
        self.now = now
        if self.lost is not None:
            raise self.lost
        if self.steps is None or not self.connected:
            raise TimedOut("the machine reports only while it is connected")
        if (age := now - self.reported_at) > self._timeout:
            raise TimedOut(f"the machine has not reported for {age:.1f} s: is it on?")
        return self.steps

    @property
    def limits(self) -> frozenset[str]:
        """Axes whose movement a limit switch has ended since they were ordered to move."""
        return frozenset(self._limits)

    @property
    def target(self) -> Target | None:
        """Where it is going to, or has arrived. None if nowhere."""
        target = tuple(order.monitor and order.monitor.target if order else None
                       for order in map(self._orders.get, AXES))
        return None if target == (None,) * len(AXES) else target

    def in_position(self, axes: Iterable[str] = AXES) -> bool:
        """Whether these axes are at their target, if they have one."""
        return self.steps is not None and all(
            to is None or at == to or axis not in axes
            for axis, at, to in zip(AXES, self.steps, self.target or self.steps, strict=True))

    def sent(self, axis: str) -> int | None:
        """Return where an axis was sent, in steps; None if it was ordered something else since."""
        return self._sent.get(axis)

    @property
    def in_motion(self) -> bool:
        """Whether it goes to a point, as far as is known."""
        return any(order.monitor and not order.ended for order in self._orders.values())

    def stale(self, now: float) -> bool:
        """Whether it should report and does not: what was reported is no longer true."""
        return self.connected and now > self.reported_at + STALE_AFTER

    def raise_pending(self) -> None:
        """Raise what is wrong, once.

        Raises
        ------
        LineLost
            If the line is gone.
        Refused
            If the machine refused something that was sent at once, the first of that.
        WasReset
            If it refused that because it was reset since it was connected.
        LimitReached
            If a limit switch ended a movement.
        """
        if self.lost is not None:
            raise self.lost
        self._raise_refused()
        if self._pending_limits:
            axes, self._pending_limits = frozenset(self._pending_limits), set()
            raise LimitReached(axes)

    def _raise_refused(self) -> None:
        if self._refusals:
            raise self._error(self._refusals.pop(0))

    def _error(self, refusal: Refusal) -> Refused | WasReset:
        """Return the error of a refusal."""
        if refusal == DISCONNECTED and self._reporting:
            return self._was_reset()
        return Refused(refusal.reason, MEANINGS.get(refusal.reason, "it does not say more"))

    def _was_reset(self) -> WasReset:
        """Note that the machine was reset, which ended all movement and the answers."""
        self._answers = False
        for known in (self._orders, self._sent, self._refusals):
            known.clear()
        return WasReset()

    def _lost(self, axes: Iterable[str] = AXES) -> list[_AxisOrder]:
        """Return what these axes were ordered last, at once, that is lost on the line."""
        return [order for axis, order in self._orders.items()
                if axis in axes and order.line.at_once and order.line.lost]

    # What is sent at once

    def jog(self, axis: str, direction: int, now: float) -> None:
        """Move an axis up (1) or down (-1), until it is stopped. Others go on to their target."""
        self.now = now
        order = lines.jog(axis, direction)
        self._clear_limits(axis)
        self._orders[axis] = _AxisOrder(self._order(axis, order), direction)
        self._superseded()

    def stop(self, axes: Iterable[str], now: float) -> None:
        """End the movement of axes. Others go on to their target."""
        self.now = now
        for axis in axes:
            self._stop(axis)
        self._superseded()

    def _stop(self, axis: str) -> None:
        self._orders[axis] = _AxisOrder(self._order(axis, lines.stop([axis])), ended=True)

    def halt(self, now: float) -> None:
        """End all movement: by a break, if the port can, and by order.

        The break does not wait for what stands in the line, which is lost.
        """
        self.now = now
        self.halts += 1
        self._unverified = True
        self._orders.clear()
        self._sent.clear()
        self._since = {axis: lines.stop([axis]) for axis in AXES}
        if self._can_break:
            self._unanswered.give_up()
            self.sent_at = now + HALT_S
            # The line that the break has damaged goes on until the first of these ends it.
            self._submit(b"\n" + lines.stop(), after_break=True)
        else:
            self._submit(lines.stop())
        self._superseded()

    def _order(self, axis: str, order: bytes) -> Line:
        self._since[axis] = order
        self._sent.pop(axis, None)
        self._unverified, self.at_rest = True, False
        return self._submit_at_once(order)

    def _submit_at_once(self, order: bytes) -> Line:
        (line,) = self._submit(order)
        line.at_once = True
        return line

    def _submit(self, data: bytes, *, after_break: bool = False) -> list[Line]:
        """Send lines; return those that will be answered."""
        self._send(data, after_break=after_break)
        return [self._unanswered.add(order, self.sent_at, self.reports)
                for order in data.splitlines(keepends=True) if order != lines.ACK_OFF]

    def _superseded(self) -> None:
        """Note that an order came in between. A travel that has not departed may be called off."""

    def _set_target(self, target: Steps | None, *axes: str, line: Line | None = None) -> None:
        """Set where these axes go to, by this line."""
        self._orders = {axis: order for axis, order in self._orders.items()
                        if axis not in axes and order.monitor is None}
        for axis, to in zip(AXES, target or (), strict=target is not None):
            if axis in axes and line is not None:
                self._orders[axis] = _AxisOrder(line, monitor=AxisMonitor(to))

    def _clear_limits(self, *axes: str) -> None:
        self._limits -= set(axes)
        self._pending_limits -= set(axes)

    # What is received

    def receive(self, data: bytes, now: float) -> list[Message]:
        """Take bytes of the line, and the time.

        Returns
        -------
        list of Message
            Messages to act on: reports, of which a state is one; limits, but not those by which a
            held jog was sent again; refusals. None while the machine is restored.
        """
        self.now = now
        if data:
            self._received_at = now
        messages = []
        for line in self._splitter.feed(lines.delimited(data)):
            message = read_line(line)
            if message is None:
                continue
            taken = self._take(message)
            if taken is not None and not self._restoring:
                messages.append(taken)
            self._resume(message)
        self._resume(None)
        return messages

    def _take(self, message: Steps | Ok | Refusal | State | Limit) -> Message | None:
        match message:
            case Steps():
                before = self._take_report(message)
                if self._attended and self.connected:
                    self._stop_unexpected({axis for axis, was, at in zip(
                        AXES, before, message, strict=True) if was != at})
                return message
            case Limit():
                return self._take_limit(message)
        doubted = self._unanswered.in_doubt
        line = self._unanswered.take(message)
        if isinstance(message, State):
            if self._reporting and not message.connected:
                return None  # it was reset, which has lost the place
            self._take_report(message.steps)
            return message.steps
        if not isinstance(message, Refusal) or doubted:
            return None
        for order in self._orders.values():
            if order.line is line:  # it moves nothing
                order.end()
        if line is not None and line.at_once and not self._attended:
            self._refusals = [*self._refusals, message][-MOST_REFUSALS:]
        return message

    def _take_report(self, steps: Steps) -> Steps:
        """Take a place; return the one before."""
        before, self.steps = self.steps or steps, steps
        self.reported_at = self.now
        self.reports += 1
        for axis, at in zip(AXES, steps, strict=True):
            if axis in self._orders:
                self._unverified |= self._orders[axis].update(at)
        return before

    def _stop_unexpected(self, moved: set[str]) -> None:
        """Verify what moved and should not; stop it at once if that is so in two reports."""
        self._unexpected, before = moved - self._ordered(), self._unexpected
        if again := self._unexpected & before:
            self._submit(lines.stop(sorted(again)))
        if self._unexpected:
            self._unverified, self.at_rest = True, False

    def _ordered(self) -> set[str]:
        """Return the axes that are ordered to move."""
        return {axis for axis, order in self._orders.items() if not order.ended}

    def _take_limit(self, limit: Limit) -> Limit | None:
        axis, order = limit.axis, self._orders.get(limit.axis)
        if order is not None and not order.ended and not order.line.ended:
            # It may have been on its way when the axis was ordered to move again.
            if self._attended and order.direction and not order.repeated:
                (order.line,) = self._submit(lines.jog(axis, order.direction))
                order.repeated = True
                self._superseded()
                return None  # if it is of this movement, it is reported again
            self._stop(axis)  # so that what is reported is true
        else:
            self._orders.pop(axis, None)
        self._sent.pop(axis, None)
        self._limits.add(axis)
        self._unverified = True
        if not self._attended:
            self._pending_limits.add(axis)
        self._superseded()
        return limit
