"""A line to a positioner, heard in the event loop."""

import asyncio
from collections.abc import Callable
from contextlib import suppress

from fresa_host import LineLost, Port, TimedOut
from fresa_host.positioner_lines import Limit, Refusal, Steps
from fresa_host.positioner_link import PositionerLink

from .writer import Writer

__all__ = ["PATIENCE", "Heard", "Line"]

#: Seconds that a machine has for a report.
PATIENCE = 2.0

Heard = Steps | Refusal | Limit


class Line:
    """A line that is open, or being opened.

    What comes before it is connected waits for `hear`; what comes then is handed on.

    Parameters
    ----------
    port : str
        The serial port.
    opened : callable
        Opens it, given its name.
    heard : callable
        Called in the event loop with what the machine says while it is connected.
    lost : callable
        Called there if the port is gone while it is connected, which it then is no more.

    Attributes
    ----------
    connected : bool
        Set by who has connected it.
    """

    def __init__(self, port: str, opened: Callable[[str], Port], heard: Callable[[Heard], None],
                 lost: Callable[[LineLost], None]) -> None:
        self.port, self._opened = port, opened
        self.connected = False
        self._heard, self._lost = heard, lost
        self._loop = asyncio.get_running_loop()
        self._link: PositionerLink | None = None
        self._writer: Writer | None = None
        self._waiting: asyncio.Queue[Heard | LineLost] = asyncio.Queue()

    async def open(self) -> None:
        """Open it.

        Raises
        ------
        LineLost
            If the port cannot be opened.
        """
        self._link = await asyncio.to_thread(lambda: PositionerLink(
            self._opened(self.port), heard=lambda said: self._later(self._take, said),
            lost=lambda error: self._later(self._lose, error)))
        self._writer = Writer(self._link)

    def close(self) -> None:
        """Send what there is, and let go of the port. Waits for both."""
        if self._writer is not None:
            self._writer.close()
        if self._link is not None:
            self._link.close()

    def say(self, orders: bytes) -> None:
        """Send orders; do not wait until they are. A port that is gone will be told of."""
        if self._writer is not None:
            self._writer.say(orders)

    def halt(self) -> bool:
        """End all movement; see `PositionerLink.halt`. Say whether other orders may be lost."""
        if self._link is None or self._writer is None:
            return False
        self._writer.halt()
        return self._link.can_break

    async def hear(self) -> Heard:
        """Wait for what the machine says next. Only before it is connected.

        Raises
        ------
        LineLost
            If the port is gone.
        TimedOut
            If it says nothing.
        """
        try:
            said = await asyncio.wait_for(self._waiting.get(), PATIENCE)
        except TimeoutError:
            raise TimedOut(f"no positioner reports at {self.port}: is it on?") from None
        if isinstance(said, LineLost):
            raise said
        return said

    def _later(self, call: Callable, what: object) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(call, what)

    def _take(self, said: Heard) -> None:
        if self.connected:
            self._heard(said)
        else:
            self._waiting.put_nowait(said)

    def _lose(self, error: LineLost) -> None:
        if self.connected:
            self.connected = False
            self._lost(error)
        else:
            self._waiting.put_nowait(error)
