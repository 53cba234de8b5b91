"""Sending without waiting."""

import threading
from collections.abc import Callable
from queue import SimpleQueue

from fresa_host import LineLost

__all__ = ["Speaker"]


class Speaker:
    """Sends what it is given, in that order, in a thread of its own.

    A port that takes nothing holds nobody up but this thread. It is then lost, for who knows what
    of an order went out; the link tells of that, and nothing more is sent.

    Parameters
    ----------
    send : callable
        Sends; see `PositionerLink.send`.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._orders: SimpleQueue[bytes | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def say(self, orders: bytes) -> None:
        """Send orders, when those before are sent."""
        self._orders.put(orders)

    def close(self) -> None:
        """Send what there is, and end."""
        self._orders.put(None)
        self._thread.join()

    def _work(self) -> None:
        while (orders := self._orders.get()) is not None:
            try:
                self._send(orders)
            except LineLost:
                return
