"""The positioner as the panel has it: connected or not, and heard in the event loop."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress

from fresa_host import LineLost, MachineError, Place, Port
from fresa_host import positioner_lines as lines
from fresa_host.port import BAUD
from fresa_host.positioner_lines import AXES, STEPS_PER_UM, Limit, Refusal, Steps
from fresa_host.positioner_way import Way

from .connecting import WITNESS, ZERO, find_place, rest
from .line import PATIENCE, Heard, Line
from .motion import Departure, Order
from .settings import Settings

__all__ = ["SILENCE", "Machine"]

#: Seconds without a report after which what is shown is no longer true.
SILENCE = 0.38

#: What the machine says of the line that a break damages, and seconds within which it does.
DAMAGED = "DAMAGED"
FORGIVEN = 0.5

#: Seconds until a break, and the orders behind it, are on the line.
HALTING = 0.1

#: Seconds until the last words are on the line: 41 bytes.
ON_LINE = 0.06


class Machine:
    """A positioner on a serial line, which may be plugged and unplugged.

    All methods but those that are asynchronous return at once. An axis that moves, and neither was
    told to nor is on its way, is told to stop with every report until it does: the line may have
    swallowed the first time. If it goes on even so, and no other axis is to move, all movement is
    ended by a break of the line. An axis that goes farther off is not on its way to a point.

    Parameters
    ----------
    opened : callable
        Opens a serial port, given its name.
    heard : callable
        Called in the event loop with what the machine says while it is connected.
    lost : callable
        Called there, with a line of text, when the port is gone.

    Attributes
    ----------
    steps : Steps or None
        The place that was reported last since it was connected.
    """

    def __init__(self, opened: Callable[[str], Port], heard: Callable[[Heard], None],
                 lost: Callable[[str], None]) -> None:
        self._opened, self._heard, self._lost = opened, heard, lost
        self._loop = asyncio.get_running_loop()
        self._line: Line | None = None
        self._closing: asyncio.Task[None] | None = None
        self._heard_at = 0.0
        self._halted_at = -FORGIVEN
        self._speeds: dict[str, float] = {}
        self._strays: set[str] = set()
        self._going: dict[str, Order] = {}  # axes that may move
        self._departure: Departure | None = None
        self._sent_at = 0.0  # when all that was sent is on the line
        self.steps: Steps | None = None

    @property
    def connected(self) -> bool:
        """Whether it can be told something."""
        return self._line is not None and self._line.connected

    @property
    def in_motion(self) -> bool:
        """Whether it goes to a point, or is about to."""
        return self._departure is not None or any(order.to for order in self._going.values())

    @property
    def silent(self) -> bool:
        """Whether it should report and does not."""
        return self.connected and self._loop.time() > self._heard_at + SILENCE

    async def connect(self, port: str, settings: Settings) -> bool:
        """Connect, stop what moves, and tell the machine its speeds, its points and its place.

        Its place only if it had forgotten that; see `find_place`.

        Returns
        -------
        bool
            Whether it was told its place.

        Raises
        ------
        LineLost
            If the port cannot be opened, or is gone.
        TimedOut
            If no machine reports, or it does not stop, or the line is too bad to know.
        """
        await self.disconnect()
        line = self._line = Line(port, self._opened, self._hear, self._lose)
        self.steps = None
        self._going, self._speeds, self._strays, self._departure = {}, {}, set(), None
        try:
            await line.open()
            place, forgot = await find_place(line, settings.steps)
        except BaseException:
            await self._let_go()
            raise
        line.connected, self.steps, self._heard_at = True, place, self._loop.time()
        for axis, speed in zip(AXES, settings.speeds, strict=True):
            self.set_speed(axis, speed)
        for number, point in enumerate(settings.points, start=1):
            self.store(number, point)
        self._send(lines.store(WITNESS, ZERO))
        return forgot

    async def disconnect(self) -> None:
        """Stop, hear where that was, and disconnect. Does nothing if it is not connected."""
        if self._closing is not None:
            await self._closing
        line = self._line
        if line is None:
            return
        with suppress(MachineError):
            if line.connected:
                line.connected = False
                self.stop()
                self.steps = await rest(line)
        await self._let_go()

    async def _let_go(self) -> None:
        """Leave the machine still and without power, if it hears that, and the port to others."""
        self._send(lines.stop() + b"DISCONNECT\n")
        await asyncio.sleep(ON_LINE)
        line, self._line = self._line, None
        if line is not None:
            await asyncio.to_thread(line.close)

    # What it is told

    def jog(self, axis: str, way: int) -> None:
        """Move an axis up (1) or down (-1), or end that (0). Nothing departs to a point then."""
        if way:
            self._going[axis] = Order(way)
        else:
            self._going.pop(axis, None)
        self._send((lines.jog(axis, way) if way else lines.stop([axis])) + self._call_off())

    def stop(self) -> None:
        """End all movement, whatever stands in the line."""
        after = self._call_off()
        self._going.clear()
        if self._line is not None and self._line.halt():
            self._halted_at = self._loop.time()
            self._sent_at = max(self._sent_at, self._halted_at + HALTING)
            for axis, speed in self._speeds.items():  # orders that were on their way are lost
                self.set_speed(axis, speed)
            self._send(lines.store(WITNESS, ZERO))
        self._send(after)

    def set_speed(self, axis: str, um_per_second: float) -> None:
        """Set the speed of an axis."""
        self._speeds[axis] = um_per_second
        self._send(lines.speed(axis, round(um_per_second * STEPS_PER_UM)))

    def store(self, number: int, point: Sequence[float | None]) -> None:
        """Let the machine keep a point, if it is whole, and not the `WITNESS`."""
        if number != WITNESS and (steps := _steps(point)) is not None:
            order = lines.store(number, steps)
            if self._departure is not None and self._departure.number == number:
                self._departure.after += order  # it departs to what the point was
            else:
                self._send(order)

    def go(self, number: int, point: Sequence[float | None]) -> Steps | None:
        """Go to a point, if it is whole; give its steps then.

        The machine is told the point, and to go there when it has not refused that: it would go to
        what the point was before.
        """
        steps = _steps(point)
        if steps is not None:
            self._send(self._call_off())
            self._send(lines.store(number, steps))
            self._departure = Departure(
                number, steps, lines.store(WITNESS, ZERO) if number == WITNESS else b"",
                due=self._sent_at, heard=self._loop.time())
        return steps

    def origin(self) -> None:
        """Call this place (0, 0, 0)."""
        self._send(self._call_off())
        self._going = {axis: order for axis, order in self._going.items() if order.to is None}
        self._send(b"ORIGIN\n")

    def _call_off(self) -> bytes:
        """Depart nowhere; give what is to be sent even so."""
        departure, self._departure = self._departure, None
        return b"" if departure is None else departure.after

    def _depart(self) -> None:
        """Tell the machine to go, if it is time for that."""
        departure, now = self._departure, self._loop.time()
        if departure is None:
            return
        if now > departure.heard + PATIENCE:  # nobody reckons with it any more
            self._send(self._call_off())
        elif departure.hear(now):
            self._going = {axis: Order(to=Way(to))
                           for axis, to in zip(AXES, departure.steps, strict=True)}
            self._send(lines.go_to(departure.number) + self._call_off())

    def _send(self, orders: bytes) -> None:
        """Send orders, if there is somebody to send them to."""
        if self._line is not None and orders:
            self._sent_at = max(self._sent_at, self._loop.time()) + 10 * len(orders) / BAUD
            self._line.say(orders)

    # What is heard, in the event loop

    def _hear(self, said: Heard) -> None:
        if isinstance(said, Steps):
            self._heard_at = self._loop.time()
            self._stop_strays(said)
            self._depart()
            self.steps = said
        elif self._is_old(said):
            return
        self._heard(said)

    def _is_old(self, said: Limit | Refusal) -> bool:
        """Take a limit or a refusal; say whether it is nobody's matter."""
        if isinstance(said, Refusal):
            return (said.reason == DAMAGED and not self.in_motion
                    and self._loop.time() < self._halted_at + FORGIVEN)
        self._send(self._call_off())
        order = self._going.get(said.axis)
        if order is not None and not order.settled:
            # It may have been on its way when the user turned round. If not, it is said again.
            if order.way:
                self._send(lines.jog(said.axis, order.way))
                return True
            self._send(lines.stop([said.axis]))
        self._going.pop(said.axis, None)
        return False

    def _stop_strays(self, now: Steps) -> None:
        """Stop what moves and should not."""
        moved = [axis for axis, was, at in zip(AXES, self.steps or now, now, strict=True)
                 if was != at]
        strays = {axis for axis in moved if axis not in self._going}
        for axis, at in zip(AXES, now, strict=True):
            if (order := self._going.get(axis)) is not None and order.hear(at):
                del self._going[axis]  # if it moves on, it is a stray
        if strays & self._strays and not self._going:
            self.stop()
        elif strays:
            self._send(lines.stop(sorted(strays)))
        self._strays = strays

    def _lose(self, error: LineLost) -> None:
        line, self._line = self._line, None
        if line is not None:
            self._closing = asyncio.create_task(asyncio.to_thread(line.close))
        self._lost(str(error))


def _steps(point: Sequence[float | None]) -> Steps | None:
    """Give the steps of a point; None if it has an empty field."""
    return None if None in point else Place(*(um or 0.0 for um in point)).steps
