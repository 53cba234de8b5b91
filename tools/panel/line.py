"""A serial port in the event loop."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from fresa_host import LineLost, Port
from fresa_host.session import Output

from .writer import Writer

__all__ = ["Line"]


class Line:
    """An open port, read in one thread and written in another.

    Parameters
    ----------
    port : Port
        The port.
    received : callable
        Called in the event loop with received bytes.
    lost : callable
        Called there, once or twice, if the port is lost.
    """

    def __init__(self, port: Port, received: Callable[[bytes], None],
                 lost: Callable[[LineLost], None]) -> None:
        self._port, self._received, self._lost = port, received, lost
        self._loop = asyncio.get_running_loop()
        self._closed = False
        self._writer = Writer(port, lambda error: self._later(lost, error))
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def send(self, output: Output) -> None:
        """Queue bytes to be sent."""
        self._writer.send(output)

    def close(self) -> None:
        """Send the queued bytes, and close the port. Waits for both."""
        self._writer.close()
        self._closed = True
        self._reader.join()
        self._port.close()

    def _read(self) -> None:
        while not self._closed:
            try:
                data = self._port.read()
            except LineLost as error:
                self._later(self._lost, error)
                return
            if data:
                self._later(self._received, data)

    def _later(self, call: Callable[[Any], None], what: object) -> None:
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(call, what)
