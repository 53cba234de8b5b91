"""The positioner as the panel has it: connected or not, and heard in the event loop."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from fresa_host import LineLost, Place, TimedOut
from fresa_host import positioner_lines as lines
from fresa_host.positioner_lines import AXES, STEPS_PER_UM, Limit, Refusal, Steps
from fresa_host.positioner_link import PositionerLink

from .kept import Kept

__all__ = ["SILENCE", "Machine"]

#: Seconds that a machine has for its first report, and for saying where it stopped.
PATIENCE = 2.0

#: Seconds without a report after which what is shown is no longer true.
SILENCE = 0.45

Heard = Steps | Refusal | Limit


@dataclass(eq=False)
class _Line:
    """A line that is open."""

    link: PositionerLink
    connected: bool = False


class Machine:
    """A positioner on a serial line, which may be plugged and unplugged.

    All methods but those that are asynchronous return at once.

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
        self._report = asyncio.Event()
        self._believe: tuple[Steps, float] | None = None
        self._heard_at = 0.0
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
        """Connect, and tell the machine its speeds, and its place if it has forgotten it.

        Returns
        -------
        bool
            Whether it had forgotten: it says that it is at (0, 0, 0), and was left elsewhere.

        Raises
        ------
        LineLost
            If the port cannot be opened.
        TimedOut
            If no machine reports.
        """
        await self.disconnect()
        line: _Line | None = None

        def later(call: Callable, what: object) -> None:
            with suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(lambda: line is not None and call(line, what))

        link = await asyncio.to_thread(
            PositionerLink, port, heard=lambda said: later(self._hear, said),
            lost=lambda error: later(self._lose, error))
        line = self._line = _Line(link)
        self.steps = self._believe = None
        self._report.clear()
        try:
            # What somebody had typed before may be taken for the beginning of the first line.
            link.send(b"CONNECT\nCONNECT\n")
            await asyncio.wait_for(self._report.wait(), PATIENCE)
        except TimeoutError:
            await self._drop()
            raise TimedOut(f"no positioner reports at {port}: is it on?") from None
        except BaseException:
            await self._drop()
            raise
        forgot = self.steps == (0, 0, 0) != kept.steps
        if forgot:
            self.call_place(kept.steps)
        line.connected = True
        for axis, speed in zip(AXES, kept.speeds, strict=True):
            self.set_speed(axis, speed)
        for number, point in enumerate(kept.points, start=1):
            self.store(number, point)
        return forgot

    async def disconnect(self) -> None:
        """Stop, hear where that was, and disconnect. Does nothing if it is not connected."""
        line = self._line
        if line is None:
            return
        with suppress(LineLost, TimeoutError):
            if line.connected:
                self.stop()
                async with asyncio.timeout(PATIENCE):
                    before = None
                    while before is None or self.steps != before:
                        before = self.steps
                        self._report.clear()
                        await self._report.wait()
            line.link.send(b"DISCONNECT\n")
            await asyncio.sleep(0.02)  # until it is on the line
        await self._drop()

    async def _drop(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            await asyncio.to_thread(line.link.close)

    def jog(self, axis: str, way: int) -> None:
        """Move an axis up (1) or down (-1), or end that (0)."""
        self._send(lines.jog(axis, way) if way else lines.stop([axis]))

    def stop(self) -> None:
        """End all movement."""
        self._send(lines.stop())

    def set_speed(self, axis: str, um_per_second: float) -> None:
        """Set the speed of an axis."""
        self._send(lines.speed(axis, round(um_per_second * STEPS_PER_UM)))

    def store(self, number: int, point: Sequence[float | None]) -> Steps | None:
        """Let the machine keep a point, if it is whole; give its steps then."""
        if None in point:
            return None
        steps = Place(*(um or 0.0 for um in point)).steps
        self._send(lines.store(number, steps))
        return steps

    def go(self, number: int) -> None:
        """Go to a point that was stored."""
        self._send(lines.go_to(number))

    def origin(self) -> None:
        """Call this place (0, 0, 0)."""
        self._send(b"ORIGIN\n")

    def call_place(self, steps: Steps) -> None:
        """Tell it where it is."""
        self._send(lines.place(steps))
        # Reports that are on their way say what it thought before.
        self._believe = steps, self._loop.time() + PATIENCE
        self.steps = steps

    def _send(self, orders: bytes) -> None:
        """Send orders. A port that is gone will be told by its thread."""
        if self._line is not None:
            with suppress(LineLost):
                self._line.link.send(orders)

    def _hear(self, line: _Line, said: Heard) -> None:
        if line is not self._line:
            return
        if isinstance(said, Steps):
            self._heard_at = self._loop.time()
            if self._believe is not None:
                steps, until = self._believe
                if said != steps and self._heard_at < until:
                    return
                self._believe = None
            self.steps = said
            self._report.set()
        if line.connected:
            self._heard(said)

    def _lose(self, line: _Line, error: LineLost) -> None:
        if line is self._line:
            self._line = None
            line.link.close()
            self._lost(str(error))
