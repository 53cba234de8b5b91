"""The stage: its session, driven by the event loop."""

import asyncio
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TypeVar

from fresa_host import LineLost, MachineError, Port
from fresa_host.session import Waiting

from .line import Line
from .settings import Settings
from .stage import AXES, STEPS_PER_UM, Message, Place, StageSession, Steps

__all__ = ["Machine"]

T = TypeVar("T")

#: Seconds within which a machine must answer.
ANSWER_TIMEOUT_S = 2.0


class Machine:
    """A stage on a serial line, which may be plugged and unplugged.

    All methods but the asynchronous ones return at once. The safety rules are in its session, a
    `StageSession`.

    Parameters
    ----------
    opened : callable
        Opens a serial port, given its name.
    on_message : callable
        Called in the event loop with each message while it is connected.
    on_loss : callable
        Called there, with a line of text, when the port is lost.
    on_motion : callable
        Called before an order that ends its rest is sent.

    Attributes
    ----------
    connected : bool
        Whether orders can be sent.
    steps : Steps or None
        The last reported position since it was connected.
    at_rest : bool
        Whether it has said that it stands there, and was not ordered to move since.
    """

    def __init__(self, opened: Callable[[str], Port], on_message: Callable[[Message], None],
                 on_loss: Callable[[str], None], on_motion: Callable[[], None]) -> None:
        self._opened, self._on_message, self._on_loss = opened, on_message, on_loss
        self._on_motion = on_motion
        self._loop = asyncio.get_running_loop()
        self._session = StageSession()
        self._line: Line | None = None
        self._closing: asyncio.Task[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._changed = asyncio.Event()
        self.connected = self.at_rest = False
        self.steps: Steps | None = None

    @property
    def in_motion(self) -> bool:
        """Whether it moves to a point, or is about to."""
        return self._session.in_motion

    @property
    def limits(self) -> frozenset[str]:
        """Axes that a limit switch has stopped, until they move again."""
        return self._session.limits

    @property
    def halts(self) -> int:
        """Number of times that all movement was stopped at once."""
        return self._session.halts

    @property
    def silent(self) -> bool:
        """Whether it does not report although it should."""
        return self.connected and self._session.stale(self._loop.time())

    async def connect(self, port: str, settings: Settings, left: Steps | None,
                      least: float) -> tuple[bool, int]:
        """Connect to a port, and restore a machine with the speeds and points of the settings.

        `left` and `least`, what is returned and raised are those of `StageSession.restore`; and
        `LineLost` is raised if the port cannot be opened, or is lost.
        """
        await self.disconnect()
        opened = await asyncio.to_thread(self._opened, port)
        session = self._session = StageSession(
            name=port, baud=opened.baud, can_break=opened.can_break, timeout=ANSWER_TIMEOUT_S)
        self._line, self.steps = Line(opened, self._receive, self._lose), None
        self.at_rest = False
        for axis, speed in zip(AXES, settings.speeds, strict=True):
            self.set_speed(axis, speed)
        for number, point in enumerate(settings.points, start=1):
            self.store(number, point)
        try:
            reset, seconds = await self._run(session.restore(left, least))
        except BaseException:
            await self._release()
            raise
        self.connected, self.steps, self.at_rest = True, session.steps, True
        return reset, seconds

    async def disconnect(self) -> None:
        """Stop, read the final position, and disconnect. Does nothing if it is not connected."""
        if self._closing is not None:
            await self._closing
        if self._line is None:
            return
        self.connected = False
        with suppress(MachineError):
            await self._run(self._session.bring_to_rest())
            self.steps, self.at_rest = self._session.steps, True
        await self._release()

    async def _release(self) -> None:
        """Stop the machine, switch its motors off if it answers, and close the port."""
        self.connected = False
        self._do(self._session.leave)
        await asyncio.sleep(self._session.sent_at - self._loop.time())
        line, self._line = self._line, None
        if line is not None:
            await asyncio.to_thread(line.close)

    async def _run(self, steps: Waiting[T]) -> T:
        operation = self._session.begin(steps, self._loop.time())
        try:
            self._send()
            while not operation.done:
                self._changed.clear()
                await self._changed.wait()
            return operation.result()
        finally:
            operation.cancel()

    async def origin(self) -> None:
        """Make this position the origin, (0, 0, 0); see `StageSession.call_origin`."""
        await self._run(self._session.call_origin())

    # What is sent

    def jog(self, axis: str, direction: int) -> None:
        """Jog an axis up (1) or down (-1), or stop it (0). A movement to a point ends."""
        if direction:
            self._do(self._session.jog, axis, direction)
        else:
            self._do(self._session.stop, [axis])

    def stop(self) -> None:
        """Stop all movement, whatever is in the line."""
        self._do(self._session.halt)

    def set_speed(self, axis: str, um_per_second: float) -> None:
        """Set the speed of an axis, in um/s."""
        self._do(self._session.set_speed, axis, round(um_per_second * STEPS_PER_UM))

    def store(self, number: int, point: Sequence[float | None]) -> None:
        """Store a point in the machine, if all its fields are filled."""
        if (steps := _steps(point)) is not None:
            self._do(self._session.keep_point, number, steps)

    def go(self, number: int, point: Sequence[float | None]) -> Steps | None:
        """Move to a point, if all its fields are filled; return its steps then."""
        if (steps := _steps(point)) is not None:
            self._do(self._session.travel, number, steps)
        return steps

    def _do(self, work: Callable[..., None], *args: object) -> None:
        """Call a method of the session with the time as its last argument, and send its output."""
        work(*args, self._loop.time())
        self._send()

    def _send(self) -> None:
        """Send the session's output, wake waiting tasks, and set a timer for its deadline."""
        if self.connected:
            rested, self.at_rest = self.at_rest, self._session.at_rest
            if rested and not self.at_rest:
                self._on_motion()
        for output in self._session.take_outputs():
            if self._line is not None:
                self._line.send(output)
        self._changed.set()
        if self._timer is not None:
            self._timer.cancel()
        deadline = self._session.deadline
        self._timer = self._loop.call_at(deadline, self._tick) if deadline < math.inf else None

    # Received, in the event loop

    def _tick(self) -> None:
        self._do(self._session.tick)

    def _receive(self, data: bytes) -> None:
        messages = self._session.receive(data, self._loop.time())
        self._send()
        for message in messages:
            if self.connected:
                if isinstance(message, Steps):
                    self.steps = message
                self._on_message(message)

    def _lose(self, error: LineLost) -> None:
        self._session.lose(error)
        self._send()
        if self.connected:
            self.connected = False
            line, self._line = self._line, None
            if line is not None:
                self._closing = asyncio.create_task(asyncio.to_thread(line.close))
            self._on_loss(str(error))


def _steps(point: Sequence[float | None]) -> Steps | None:
    """Return the steps of a point; None if it has an empty field."""
    return None if None in point else Place(*(um or 0.0 for um in point)).steps
