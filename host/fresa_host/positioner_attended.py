"""The session of a positioner that people move and watch."""

import math
from typing import Any

from . import positioner_lines as lines
from .errors import MachineError, Refused, TimedOut, WasReset
from .positioner_lines import AXES, START_SPEED, ZERO, State, Steps
from .positioner_session import ANSWER_TIMEOUT_S, TRIES, PositionerSession
from .session import Operation, Waiting

__all__ = ["AttendedSession"]


class AttendedSession(PositionerSession):
    """One positioner on a line, with people who hold what moves, and see what is refused.

    Once it is `connected`, an axis that moves, and neither was ordered to nor is on its way, is
    stopped until STATE reports that it stands, if need be by a break; a jog goes on if a limit
    may be of the movement before; a travel that is refused stops all axes, and an order in between
    calls off one that has not departed; and refusals and limits are returned by `receive` alone.

    Parameters
    ----------
    options
        As for `PositionerSession`.

    Attributes
    ----------
    at_rest : bool
        STATE reports that nothing moves, and nothing was ordered since.
    """

    _attended = True

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._settings: dict[str | int, bytes] = {}  # orders to deliver, by axis and by point
        self._travel: Operation[None] | None = None
        self._verification: Operation[None] | None = None
        self._delivery: Operation[None] | None = None

    # Beginning and end

    def restore(self, left: Steps | None, least: float) -> Waiting[tuple[bool, int]]:
        """Stop what moves, send the machine its settings, and its place if it was reset; connect.

        It was reset if it counts too few seconds, or has the speeds that it has after a reset: the
        clock by which `least` was measured may have been set since.

        Parameters
        ----------
        left : Steps or None
            Where the machine was left, which is sent to it if it was reset and stands at `ZERO`.
        least : float
            Seconds that it has been on, at least, if it was not reset; minus infinity if it was
            never connected.

        Returns
        -------
        bool, int
            Whether it was reset, and the seconds that it has been on.

        Raises
        ------
        TimedOut
            If no machine answers, or it does not stop, or the line is too bad to know.
        """
        self._restoring, self._reporting = True, False
        yield from self._open()
        yield from self._rest()
        state = yield from self._confirmed()
        reset = state.seconds < least or (
            least > -math.inf and set(state.speeds) == {START_SPEED})
        if reset and left is not None and state.steps == ZERO:
            yield from self._obey(lines.place(left))
            if (yield from self.fence()).steps != left:
                raise self._disturbed()
        while self._settings:
            yield from self._deliver_next()
        yield from self._power()
        self._restoring, self._unverified, self.at_rest = False, False, True
        self._verification = self.begin(self._verify(), self.now)
        self._delivery = self.begin(self._deliver(), self.now)
        return reset, state.seconds

    def _confirmed(self) -> Waiting[State]:
        """Return a state that the one before confirms: either may be damaged."""
        state = yield from self.fence()
        for _ in range(TRIES):
            before, state = state, (yield from self.fence())
            seconds = state.seconds - before.seconds
            if 0 <= seconds <= 1 and state[:-1] == before[:-1]:
                return state
        raise self._disturbed()

    def _rest(self) -> Waiting[None]:
        """Stop it, and raise `TimedOut` if it is not known to stand."""
        if not (yield from self._stop_and_verify()):
            raise TimedOut(f"the machine at {self.name} does not stop: it moves")

    def bring_to_rest(self) -> Waiting[None]:
        """Halt, and wait until it stands.

        Raises
        ------
        TimedOut
            If it is not known to stand.
        WasReset
            If it was reset, and has lost where it stands.
        """
        for operation in filter(None, (self._verification, self._delivery)):
            operation.cancel()
        self._restoring = True
        self.halt(self.now)
        if any((yield from self.fence()).moving):
            yield from self._rest()

    def leave(self, now: float) -> None:
        """Stop all axes and take the power from the motors, if the machine hears that."""
        self.now, self._reporting = now, False
        self._submit(lines.stop() + lines.DISCONNECT)
        self.release(now)

    def call_origin(self) -> Waiting[None]:
        """Call this place (0, 0, 0), if it stands; end when STATE reports that.

        Raises
        ------
        TimedOut
            If it moves, or does not report that.
        """
        self._call_off()
        yield from self._standing(AXES)
        yield from self.rename(lines.ORIGIN)
        if self.steps != ZERO:
            raise self._disturbed()

    # In the background

    def _verify(self) -> Waiting[None]:
        """Have the machine say, behind each order, that what is ordered to stand does; stop it."""
        wrong: set[str] = set()
        while True:
            if not (self.connected and self._unverified):
                yield math.inf
                continue
            self._unverified = False
            try:
                state = yield from self.fence()
            except TimedOut:
                self._unverified = True
                yield math.inf  # until something is received
                continue
            except WasReset:  # where it stands is not known
                return
            moving = {axis for axis, moves in zip(AXES, state.moving, strict=True) if moves}
            later = set()  # ordered since STATE was sent
            for axis, order in self._orders.items():
                if not order.line.ended:
                    later.add(axis)
                elif axis not in moving:
                    order.end()
                elif order.monitor:
                    order.monitor.resume()
            before, wrong = wrong, moving - self._ordered() - later
            if wrong & before and not self._ordered():
                self.halt(self.now)
            elif wrong:
                self._submit(lines.stop(sorted(wrong)))
            self._unverified |= bool(wrong or later)
            self.at_rest = not (moving or self._ordered() or self._unverified or self.in_motion)

    def _deliver(self) -> Waiting[None]:
        """Send the settings, each until it is obeyed, but not while a travel departs."""
        while True:
            if not (self.connected and self._settings) or self._departs:
                yield math.inf
                continue
            try:
                yield from self._deliver_next()
            except WasReset:
                return
            except MachineError:
                # What is refused each time must not keep the line busy.
                again = self.now + ANSWER_TIMEOUT_S
                while self.now < again:
                    yield again

    def _deliver_next(self) -> Waiting[None]:
        key, order = next(iter(self._settings.items()))
        for tries in range(1, TRIES + 1):
            try:
                yield from self._obey(order)
                break
            except Refused as refused:  # which `receive` has returned
                if tries == TRIES and refused.reason != "RANGE":
                    raise self._disturbed() from refused
        if self._settings.get(key) == order:
            del self._settings[key]

    # At once

    def travel(self, number: int, steps: Steps, now: float) -> None:
        """Begin to `move_to` a point; any other order before it departs calls it off."""
        self.now = now
        self._call_off()
        self.at_rest = False
        if self._delivery is not None:  # what it sends again may be this point as it was
            self._delivery.cancel()
        self._travel = self.begin(self._travel_to(number, steps), now)
        self._delivery = self.begin(self._deliver(), now)

    def _travel_to(self, number: int, steps: Steps) -> Waiting[None]:
        try:
            yield from self.move_to(number, steps)
        except Refused:
            self._travel = None
            self.halt(self.now)
        finally:
            self._unverified = True

    def set_speed(self, axis: str, steps_per_second: int, now: float) -> None:
        """Have the speed of an axis set."""
        self._set(axis, lines.speed(axis, steps_per_second), now)

    def keep_point(self, number: int, steps: Steps, now: float) -> None:
        """Have the machine keep a point, when no travel is about to depart to it."""
        self._set(number, lines.store(number, steps), now)

    def _set(self, key: str | int, order: bytes, now: float) -> None:
        self._settings[key] = order
        self.tick(now)

    @property
    def _departs(self) -> bool:
        """Whether a travel has been begun, and not been ordered to go for certain."""
        return self._travel is not None and not self._travel.done

    @property
    def in_motion(self) -> bool:
        """Whether it goes to a point, or is about to."""
        return super().in_motion or self._departs

    def _superseded(self) -> None:
        self._call_off()

    def _call_off(self) -> None:
        travel, self._travel = self._travel, None
        if travel is not None:
            travel.cancel()
