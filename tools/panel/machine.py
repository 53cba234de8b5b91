"""The positioner as the panel has it: connected or not, and heard in the event loop."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from fresa_host import LineLost, MachineError, Place, TimedOut
from fresa_host import positioner_lines as lines
from fresa_host.positioner_lines import AXES, POINTS, STEPS_PER_UM, Limit, Refusal, Steps
from fresa_host.positioner_link import PositionerLink

from .kept import Kept
from .speaker import Speaker

__all__ = ["SILENCE", "Machine"]

#: Seconds that a machine has for a report, for standing still, and for taking its place.
PATIENCE = 2.0

#: Seconds without a report after which what is shown is no longer true.
SILENCE = 0.45

ZERO = Steps(0, 0, 0)

#: The point that is `ZERO` in the machine, except on the way to what the user calls so.
WITNESS = POINTS[-1]

#: A line that is always refused, for a reason that no other has here: so what was before is known.
FENCE = b"VEL MOT1 0\n"

#: Times that a machine is asked whether it was reset, and reports after which no answer comes.
TRIES = 3
SETTLED = 2
MUTE = 10

#: Seconds until the last words are on the line: 41 bytes.
ON_LINE = 0.06

Heard = Steps | Refusal | Limit


@dataclass(eq=False)
class _Line:
    """A line that is open, or being opened. What comes before it is connected waits in `heard`."""

    port: str
    link: PositionerLink | None = None
    speaker: Speaker | None = None
    connected: bool = False
    heard: asyncio.Queue[Heard | LineLost] = field(default_factory=asyncio.Queue)

    def close(self) -> None:
        """Send what there is, and let go of the port. Waits for both."""
        if self.speaker is not None:
            self.speaker.close()
        if self.link is not None:
            self.link.close()


class Machine:
    """A positioner on a serial line, which may be plugged and unplugged.

    All methods but those that are asynchronous return at once. An axis that moves, and neither was
    told to nor is on its way, is told to stop with every report until it does: the line may have
    swallowed the first time.

    Parameters
    ----------
    heard : callable
        Called in the event loop with what the machine says while it is connected.
    lost : callable
        Called there, with a line of text, when the port is gone.

    Attributes
    ----------
    steps : Steps or None
        The place that was reported last since it was connected.
    """

    def __init__(self, heard: Callable[[Heard], None], lost: Callable[[str], None]) -> None:
        self._heard, self._lost = heard, lost
        self._loop = asyncio.get_running_loop()
        self._line: _Line | None = None
        self._closing: asyncio.Task[None] | None = None
        self._heard_at = 0.0
        # Axes that may move, and where to; None for those that go on until they are stopped.
        self._going: dict[str, int | None] = {}
        self.steps: Steps | None = None

    @property
    def connected(self) -> bool:
        """Whether it can be told something."""
        return self._line is not None and self._line.connected

    @property
    def silent(self) -> bool:
        """Whether it should report and does not."""
        return self.connected and self._loop.time() > self._heard_at + SILENCE

    async def connect(self, port: str, kept: Kept) -> bool:
        """Connect, stop what moves, and tell the machine its speeds, its points and its place.

        Its place only if it was reset, and left elsewhere. It was if it stands at (0, 0, 0) and
        has no `WITNESS`: a reset forgets points, and somebody's origin does not. To ask for that
        point moves nothing, for that is (0, 0, 0) too. If another program has put it elsewhere,
        the speed is the lowest and the order to stop right behind: an axis makes a step at most.

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
        line = self._line = _Line(port)
        self.steps = None
        self._going = {}
        try:
            line.link = await asyncio.to_thread(
                PositionerLink, port, heard=lambda said: self._later(self._hear, line, said),
                lost=lambda error: self._later(self._lose, line, error))
            line.speaker = Speaker(line.link.send)
            # What somebody had typed before may be taken for the beginning of the first line.
            self._send(b"CONNECT\n" + lines.stop() + b"CONNECT\n")
            await self._next(line)
            self._send(lines.stop())
            place = await self._rest(line)
            forgot = place == ZERO != kept.steps and await self._was_reset(line)
            place = await (self._tell_place(line, kept.steps) if forgot else self._rest(line))
        except BaseException:
            await self._let_go()
            raise
        line.connected, self.steps, self._heard_at = True, place, self._loop.time()
        for axis, speed in zip(AXES, kept.speeds, strict=True):
            self.set_speed(axis, speed)
        for number, point in enumerate(kept.points, start=1):
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
                self.steps = await self._rest(line)
        await self._let_go()

    async def _let_go(self) -> None:
        """Leave the machine still and without power, if it hears that, and the port to others."""
        self._send(lines.stop() + b"DISCONNECT\n")
        await asyncio.sleep(ON_LINE)
        line, self._line = self._line, None
        if line is not None:
            await asyncio.to_thread(line.close)

    # What connecting is made of

    async def _next(self, line: _Line) -> Heard:
        """Wait for what the machine says next."""
        try:
            said = await asyncio.wait_for(line.heard.get(), PATIENCE)
        except TimeoutError:
            raise TimedOut(f"no positioner reports at {line.port}: is it on?") from None
        if isinstance(said, LineLost):
            raise said
        return said

    async def _rest(self, line: _Line) -> Steps:
        """Wait until two reports say the same; tell it to stop until they do."""
        end, before = self._loop.time() + PATIENCE, None
        while self._loop.time() < end:
            if isinstance(said := await self._next(line), Steps):
                if said == before:
                    return said
                if before is not None:
                    self._send(lines.stop())
                before = said
        raise TimedOut(f"the positioner at {line.port} does not stop: it moves")

    async def _was_reset(self, line: _Line) -> bool:
        """Ask a machine that stands at `ZERO` for its `WITNESS`."""
        slow = b"".join(lines.speed(axis, 1) for axis in AXES)
        for _ in range(TRIES):
            self._send(slow + lines.go_to(WITNESS) + lines.stop() + FENCE)
            answers, quiet = [], 0
            while quiet < (SETTLED if answers else MUTE):
                said = await self._next(line)
                if isinstance(said, Refusal):
                    answers.append(said.reason)
                quiet = quiet + 1 if isinstance(said, Steps) else 0
            if sorted(answers) in (["RANGE"], ["EMPTY", "RANGE"]):
                return "EMPTY" in answers
        raise TimedOut(f"the line to the positioner at {line.port} is disturbed")

    async def _tell_place(self, line: _Line, steps: Steps) -> Steps:
        """Tell it where it is, until it says so itself."""
        for _ in range(TRIES):
            self._send(lines.place(steps))
            for _ in range(MUTE):
                if await self._next(line) == steps:
                    return steps
        raise TimedOut(f"the line to the positioner at {line.port} is disturbed")

    # What it is told

    def jog(self, axis: str, way: int) -> None:
        """Move an axis up (1) or down (-1), or end that (0)."""
        if way:
            self._going[axis] = None
        else:
            self._going.pop(axis, None)
        self._send(lines.jog(axis, way) if way else lines.stop([axis]))

    def stop(self) -> None:
        """End all movement."""
        self._going.clear()
        self._send(lines.stop())

    def set_speed(self, axis: str, um_per_second: float) -> None:
        """Set the speed of an axis."""
        self._send(lines.speed(axis, round(um_per_second * STEPS_PER_UM)))

    def store(self, number: int, point: Sequence[float | None]) -> None:
        """Let the machine keep a point, if it is whole, and not the `WITNESS`."""
        if number != WITNESS and (steps := _steps(point)) is not None:
            self._send(lines.store(number, steps))

    def go(self, number: int, point: Sequence[float | None]) -> Steps | None:
        """Go to a point, if it is whole; give its steps then."""
        steps = _steps(point)
        if steps is not None:
            self._going = dict(zip(AXES, steps, strict=True))
            after = lines.store(WITNESS, ZERO) if number == WITNESS else b""
            self._send(lines.store(number, steps) + lines.go_to(number) + after)
        return steps

    def origin(self) -> None:
        """Call this place (0, 0, 0)."""
        self._going = {axis: there for axis, there in self._going.items() if there is None}
        self._send(b"ORIGIN\n")

    def _send(self, orders: bytes) -> None:
        """Send orders. A port that is gone will be told by its threads."""
        if self._line is not None and self._line.speaker is not None:
            self._line.speaker.say(orders)

    # What is heard, in the event loop

    def _later(self, call: Callable, line: _Line, what: object) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(call, line, what)

    def _hear(self, line: _Line, said: Heard) -> None:
        if line is not self._line:
            return
        if not line.connected:
            line.heard.put_nowait(said)
            return
        if isinstance(said, Steps):
            self._heard_at = self._loop.time()
            self._stop_strays(said)
            self.steps = said
        elif isinstance(said, Limit):
            self._going.pop(said.axis, None)
        self._heard(said)

    def _stop_strays(self, now: Steps) -> None:
        """Stop what moves and should not."""
        moved = [axis for axis, was, at in zip(AXES, self.steps or now, now, strict=True)
                 if was != at]
        if strays := [axis for axis in moved if axis not in self._going]:
            self._send(lines.stop(strays))
        for axis, at in zip(AXES, now, strict=True):
            if self._going.get(axis) == at:
                del self._going[axis]

    def _lose(self, line: _Line, error: LineLost) -> None:
        if line is not self._line:
            return
        line.heard.put_nowait(error)
        if line.connected:
            self._line = None
            self._closing = asyncio.create_task(asyncio.to_thread(line.close))
            self._lost(str(error))


def _steps(point: Sequence[float | None]) -> Steps | None:
    """Give the steps of a point; None if it has an empty field."""
    return None if None in point else Place(*(um or 0.0 for um in point)).steps
