"""Sending without waiting."""

import threading
from collections.abc import Callable
from queue import SimpleQueue

from fresa_host import LineLost
from fresa_host.positioner_link import PositionerLink

__all__ = ["Writer"]


class Writer:
    """Sends what it is given, in that order, in a thread of its own.

    A port that takes nothing holds nobody up but this thread. It is then lost, for who knows what
    of an order went out; the link tells of that, and nothing more is sent.

    Parameters
    ----------
    link : PositionerLink
        Where to.
    """

    def __init__(self, link: PositionerLink) -> None:
        self._link = link
        self._work: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def say(self, orders: bytes) -> None:
        """Send orders, when those before are sent."""
        self._work.put(lambda: self._link.send(orders))

    def halt(self) -> None:
        """End all movement, when what is before is handed to the port. See `PositionerLink`."""
        self._work.put(self._link.halt)

    def close(self) -> None:
        """Send what there is, and end."""
        self._work.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                work()
            except LineLost:
                return
