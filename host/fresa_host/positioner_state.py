"""What a positioner was ordered and what it reports: the state of its session."""

from collections.abc import Iterable
from dataclasses import dataclass

from . import positioner_lines as lines
from .axis_monitor import AxisMonitor
from .errors import LimitReached, Refused, TimedOut
from .lines import LineSplitter
from .positioner_lines import AXES, MEANINGS, Limit, Refusal, Steps, read_line
from .session import Session

__all__ = ["SETTLED", "RESET_MARKER", "ZERO", "Message", "PositionerState", "Target"]

#: A message of the machine.
Message = Steps | Refusal | Limit

#: Where each axis is going to; None for one that may be anywhere.
Target = tuple[int | None, ...]

#: Reports after which what is heard is of what was sent: a refusal of it would have come, and a
#: limit is of no movement before. The first may have been on its way.
SETTLED = 2

#: Refusals that are kept until a call raises them.
MOST_REFUSALS = 10

#: Seconds without a report after which what was reported is no longer true.
STALE_AFTER = 0.38

#: What the machine says of the line that a break damages, and seconds within which it does.
DAMAGED = "DAMAGED"
BREAK_TIMEOUT_S = 0.5

#: Seconds until a break is on the line.
HALT_S = 0.1

ZERO = Steps(0, 0, 0)

#: The point that tells whether the machine was reset: `ZERO`, except on the way to what the user
#: calls so.
RESET_MARKER = lines.POINTS[-1]


@dataclass
class _AxisOrder:
    """What an axis was ordered last: to move until it is stopped, or to a target.

    Attributes
    ----------
    due : float
        When the order is on the line.
    direction : int
        Which way it moves; 0 if it goes to a target.
    monitor : AxisMonitor or None
        Its way to the target.
    reports : int
        Reports since.
    ended : bool
        It has arrived, or will not.
    """

    due: float
    direction: int = 0
    monitor: AxisMonitor | None = None
    reports: int = 0
    ended: bool = False

    @property
    def settled(self) -> bool:
        """Whether what is heard is of this order, and not of one before."""
        return self.reports >= SETTLED

    def end(self) -> None:
        """Note that the axis is to stand. What is heard next may still be of the movement."""
        self.direction, self.monitor, self.ended = 0, None, True

    def hear(self, at: int, now: float) -> None:
        """Take a report."""
        if self.settled and (monitor := self.monitor) is not None:
            monitor.hear(at)
            self.ended |= at == monitor.target or monitor.leads_away or monitor.stalled
        self.reports += now >= self.due


class PositionerState(Session):
    """What was ordered, what was heard, and what is sent at once. See `PositionerSession`."""

    def __init__(self, *, name: str, baud: int, can_break: bool, timeout: float,
                 attended: bool) -> None:
        super().__init__(baud)
        self.name, self._timeout, self._attended = name, timeout, attended
        self._can_break = can_break
        self._splitter = LineSplitter()
        self._orders: dict[str, _AxisOrder] = {}
        self._since: dict[str, bytes] = {}  # what axes were ordered since a travel began
        self._refusals: list[Refusal] = []
        self._limits: set[str] = set()
        self._pending_limits: set[str] = set()
        self._unexpected: set[str] = set()  # axes that moved without an order in the last report
        self._sent: dict[str, int] = {}  # where axes were sent, unless ordered something since
        self._moved: set[str] = set()  # from the last report but one to the last
        self._speeds: dict[str, int] = {}
        self._has_marker = False
        self._halted_at = -BREAK_TIMEOUT_S
        self._reporting = self._restoring = False
        self.steps: Steps | None = None
        self.reported_at = 0.0
        self.reports = self.halts = 0

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

    def moving(self, axes: Iterable[str], now: float) -> bool:
        """Return whether one of these axes moves, by the last report, or is still to go somewhere.

        Raises
        ------
        LineLost
            If the line is gone.
        TimedOut
            If it is connected, and the last report is older than the timeout.
        """
        self.now = now
        if self.lost is not None or self.connected:
            self.place(now)
        return self.connected and any(map(self._moves, axes))

    def _moves(self, axis: str) -> bool:
        if self.steps is not None and (sent := self._sent.get(axis)) is not None:
            return self.steps[AXES.index(axis)] != sent
        order = self._orders.get(axis)
        return axis in self._moved or order is not None and order.direction != 0

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

    def check(self, now: float) -> None:
        """Raise what is wrong, as `raise_pending` does."""
        self.now = now
        self.raise_pending()

    def raise_pending(self) -> None:
        """Raise what is wrong, once.

        Raises
        ------
        LineLost
            If the line is gone.
        Refused
            If the machine refused something, the first that it refused.
        LimitReached
            If a limit switch ended a movement.
        """
        if self.lost is not None:
            raise self.lost
        if self._refusals:
            reason = self._refusals.pop(0).reason
            raise Refused(reason, MEANINGS.get(reason, "it does not say more"))
        if self._pending_limits:
            axes, self._pending_limits = frozenset(self._pending_limits), set()
            raise LimitReached(axes)

    # What is sent at once

    def jog(self, axis: str, direction: int, now: float) -> None:
        """Move an axis up (1) or down (-1), until it is stopped. Others go on to their target."""
        self.now = now
        order = lines.jog(axis, direction)
        self._clear_limits(axis)
        self._order(axis, order)
        self._orders[axis] = _AxisOrder(self.sent_at, direction)
        self._superseded()

    def stop(self, axes: Iterable[str], now: float) -> None:
        """End the movement of axes. Others go on to their target."""
        self.now = now
        for axis in axes:
            self._order(axis, lines.stop([axis]))
            if axis in self._orders:
                self._orders[axis].end()
        self._superseded()

    def halt(self, now: float) -> None:
        """End all movement: by a break, if the port can, and by order.

        The break does not wait for what stands in the line, which is lost; speeds set by
        `set_speed`, and the `RESET_MARKER`, are sent again. The machine refuses one line, as
        `DAMAGED`.
        """
        self.now = now
        self.halts += 1
        self._orders.clear()
        self._sent.clear()
        if not self._can_break:
            self._send(lines.stop())
        else:
            # The line that the break has damaged goes on until the first of these ends it.
            self._send(lines.stop(AXES[:1]) + lines.stop(), after_break=True)
            self._halted_at = now
            self.sent_at += HALT_S
            for axis, speed in self._speeds.items():
                self._send(lines.speed(axis, speed))
            if self._has_marker:
                self._send(lines.store(RESET_MARKER, ZERO))
        self._superseded()

    def set_speed(self, axis: str, steps_per_second: int, now: float) -> None:
        """Set the speed of an axis, which a refusal does not change back."""
        self.now = now
        order = lines.speed(axis, steps_per_second)
        self._speeds[axis] = steps_per_second
        self._send(order)

    def _order(self, axis: str, order: bytes) -> None:
        self._since[axis] = order
        self._sent.pop(axis, None)
        self._send(order)

    def _superseded(self) -> None:
        """Note that an order came in between. A travel that has not departed may be called off."""

    def _set_target(self, target: Steps | None, *axes: str) -> None:
        """Set where these axes go to."""
        self._orders = {axis: order for axis, order in self._orders.items()
                        if axis not in axes and order.monitor is None}
        for axis, to in zip(AXES, target or (), strict=target is not None):
            if axis in axes:
                self._orders[axis] = _AxisOrder(self.sent_at, monitor=AxisMonitor(to))

    def _clear_limits(self, *axes: str) -> None:
        self._limits -= set(axes)
        self._pending_limits -= set(axes)

    # What is heard

    def receive(self, data: bytes, now: float) -> list[Message]:
        """Take bytes of the line, and the time.

        Returns
        -------
        list of Message
            Messages to act on. Not among them is what a break of ours made the machine refuse, nor
            a limit by which a held jog was sent again, nor what came while it was restored.
        """
        self.now = now
        messages = []
        for line in self._splitter.feed(data):
            if (message := read_line(line)) is None:
                continue
            if self._take(message) and not self._restoring:
                messages.append(message)
            self._resume(message)
        self._resume(None)
        return messages

    def _take(self, message: Message) -> bool:
        match message:
            case Steps():
                self._take_report(message)
            case Refusal():
                return self._take_refusal(message)
            case Limit():
                return self._take_limit(message.axis)
        return True

    def _take_report(self, steps: Steps) -> None:
        before, self.steps = self.steps, steps
        self.reported_at = self.now
        self.reports += 1
        self._moved = {axis for axis, was, at in zip(AXES, before or steps, steps, strict=True)
                       if was != at}
        if self._attended and self.connected and before is not None:
            self._stop_unexpected(self._moved)
        for axis, at in zip(AXES, steps, strict=True):
            if axis in self._orders:
                self._orders[axis].hear(at, self.now)

    def _stop_unexpected(self, moved: set[str]) -> None:
        """Stop what moves and should not: in the end by a break, if nothing else may move."""
        ordered = {axis for axis, order in self._orders.items() if not order.ended}
        unexpected = moved - ordered
        if unexpected & self._unexpected and not ordered:
            self.halt(self.now)
        elif unexpected:
            self._send(lines.stop(sorted(unexpected)))
        self._unexpected = unexpected

    def _take_refusal(self, refusal: Refusal) -> bool:
        if (refusal.reason == DAMAGED and not self.in_motion
                and self.now < self._halted_at + BREAK_TIMEOUT_S):
            return False
        if not (self._attended and self.connected):
            self._refusals = [*self._refusals, refusal][-MOST_REFUSALS:]
        elif self.in_motion:  # it may be of the point
            self.halt(self.now)
        return True

    def _take_limit(self, axis: str) -> bool:
        order = self._orders.get(axis)
        if order is not None and not order.settled:
            # It may have been on its way when the axis was ordered to move again.
            if self._attended and order.direction:
                self._send(lines.jog(axis, order.direction))  # if not, it is reported again
                self._superseded()
                return False
            self._send(lines.stop([axis]))  # so that what is reported is true
        if order is not None:
            order.end()
        self._sent.pop(axis, None)
        self._limits.add(axis)
        if not self._attended:
            self._pending_limits.add(axis)
        self._superseded()
        return True
