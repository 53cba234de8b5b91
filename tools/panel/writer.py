"""Sending without waiting."""

import threading
from collections.abc import Callable
from queue import SimpleQueue

from fresa_host import LineLost, Port
from fresa_host.session import Output

__all__ = ["Writer"]


class Writer:
    """Sends what it is given, in that order, in a thread of its own.

    A port that takes nothing holds up this thread alone. It is then lost, for it is not known what
    of an order went out, and nothing more is sent.

    Parameters
    ----------
    port : Port
        Where to.
    lost : callable
        Called in that thread when the port is lost.
    """

    def __init__(self, port: Port, lost: Callable[[LineLost], None]) -> None:
        self._port, self._lost = port, lost
        self._work: SimpleQueue[Output | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, output: Output) -> None:
        """Send bytes, when those before are handed to the port."""
        self._work.put(output)

    def close(self) -> None:
        """Send what there is, and end."""
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
