"""Sending to a serial port without blocking."""

import threading
from collections.abc import Callable
from queue import SimpleQueue

from fresa_host import LineLost, Port
from fresa_host.session import Output

__all__ = ["Writer"]


class Writer:
    """Sends bytes in order, in a thread of its own.

    A port that blocks holds up this thread only. It is then lost: how much of an order was sent is
    not known, and nothing more is sent.

    Parameters
    ----------
    port : Port
        The port.
    lost : callable
        Called in that thread when the port is lost.
    """

    def __init__(self, port: Port, lost: Callable[[LineLost], None]) -> None:
        self._port, self._lost = port, lost
        self._work: SimpleQueue[Output | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, output: Output) -> None:
        """Queue bytes."""
        self._work.put(output)

    def close(self) -> None:
        """Send the queued bytes, and end the thread."""
        self._work.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (output := self._work.get()) is not None:
            try:
                if output.after_break:
                    self._port.send_break()
                self._port.write(output.data)
            except LineLost as error:
                self._lost(error)
                return
