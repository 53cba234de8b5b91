"""The stage as the panel has it: its session, driven by the event loop."""

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

#: Seconds that a machine has for a report.
REPORT_TIMEOUT_S = 2.0


class Machine:
    """A stage on a serial line, which may be plugged and unplugged.

    All methods but those that are asynchronous return at once. What makes it safe is in its
    session: see `StageSession`, which is attended here.

    Parameters
    ----------
    opened : callable
        Opens a serial port, given its name.
    heard : callable
        Called in the event loop with each message while it is connected.
    lost : callable
        Called there, with a line of text, when the port is gone.

    Attributes
    ----------
    connected : bool
        Orders can be sent.
    steps : Steps or None
        The place that was reported last since it was connected.
    """

    def __init__(self, opened: Callable[[str], Port], heard: Callable[[Message], None],
                 lost: Callable[[str], None]) -> None:
        self._opened, self._heard, self._lost = opened, heard, lost
        self._loop = asyncio.get_running_loop()
        self._session = StageSession()
        self._line: Line | None = None
        self._closing: asyncio.Task[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._changed = asyncio.Event()
        self.connected = False
        self.steps: Steps | None = None

    @property
    def in_motion(self) -> bool:
        """Whether it goes to a point, or is about to."""
        return self._session.in_motion

    @property
    def limits(self) -> frozenset[str]:
        """Axes that a limit switch has stopped, until they are moved."""
        return self._session.limits

    @property
    def halts(self) -> int:
        """Times that all movement was ended at once."""
        return self._session.halts

    @property
    def silent(self) -> bool:
        """Whether it should report and does not."""
        return self.connected and self._session.stale(self._loop.time())

    async def connect(self, port: str, settings: Settings) -> bool:
        """Connect, stop what moves, and send the machine its speeds, its points and its place.

        Its place only if it had forgotten that; see `StageSession.restore`.

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
        opened = await asyncio.to_thread(self._opened, port)
        session = self._session = StageSession(
            name=port, baud=opened.baud, can_break=opened.can_break, timeout=REPORT_TIMEOUT_S,
            attended=True)
        self._line, self.steps = Line(opened, self._receive, self._lose), None
        try:
            forgot = await self._run(session.restore(settings.steps))
        except BaseException:
            await self._let_go()
            raise
        self.connected, self.steps = True, session.steps
        for axis, speed in zip(AXES, settings.speeds, strict=True):
            self.set_speed(axis, speed)
        for number, point in enumerate(settings.points, start=1):
            self.store(number, point)
        self._do(session.keep_reset_marker)
        return forgot

    async def disconnect(self) -> None:
        """Stop, hear where that was, and disconnect. Does nothing if it is not connected."""
        if self._closing is not None:
            await self._closing
        if self._line is None:
            return
        self.connected = False
        with suppress(MachineError):
            await self._run(self._session.bring_to_rest())
            self.steps = self._session.steps
        await self._let_go()

    async def _let_go(self) -> None:
        """Leave the machine still and without power, if it hears that, and the port to others."""
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

    # What is sent

    def jog(self, axis: str, direction: int) -> None:
        """Move an axis up (1) or down (-1), or end that (0). It departs to no point then."""
        if direction:
            self._do(self._session.jog, axis, direction)
        else:
            self._do(self._session.stop, [axis])

    def stop(self) -> None:
        """End all movement, whatever stands in the line."""
        self._do(self._session.halt)

    def set_speed(self, axis: str, um_per_second: float) -> None:
        """Set the speed of an axis."""
        self._do(self._session.set_speed, axis, round(um_per_second * STEPS_PER_UM))

    def store(self, number: int, point: Sequence[float | None]) -> None:
        """Let the machine keep a point, if it is whole."""
        if (steps := _steps(point)) is not None:
            self._do(self._session.keep_point, number, steps)

    def go(self, number: int, point: Sequence[float | None]) -> Steps | None:
        """Go to a point, if it is whole; give its steps then."""
        if (steps := _steps(point)) is not None:
            self._do(self._session.travel, number, steps)
        return steps

    def origin(self) -> None:
        """Call this place (0, 0, 0)."""
        self._do(self._session.call_origin)

    def _do(self, work: Callable[..., None], *args: object) -> None:
        """Do at once what the session does, given the time last."""
        work(*args, self._loop.time())
        self._send()

    def _send(self) -> None:
        """Send what the session has to send, and wake what waits for it, by its deadline if so."""
        for output in self._session.take_outputs():
            if self._line is not None:
                self._line.send(output)
        self._changed.set()
        if self._timer is not None:
            self._timer.cancel()
        deadline = self._session.deadline
        self._timer = self._loop.call_at(deadline, self._tick) if deadline < math.inf else None

    # What is heard, in the event loop

    def _tick(self) -> None:
        self._do(self._session.tick)

    def _receive(self, data: bytes) -> None:
        messages = self._session.receive(data, self._loop.time())
        self._send()
        for message in messages:
            if self.connected:
                if isinstance(message, Steps):
                    self.steps = message
                self._heard(message)

    def _lose(self, error: LineLost) -> None:
        self._session.lose(error)
        self._send()
        if self.connected:
            self.connected = False
            line, self._line = self._line, None
            if line is not None:
                self._closing = asyncio.create_task(asyncio.to_thread(line.close))
            self._lost(str(error))


def _steps(point: Sequence[float | None]) -> Steps | None:
    """Give the steps of a point; None if it has an empty field."""
    return None if None in point else Place(*(um or 0.0 for um in point)).steps
