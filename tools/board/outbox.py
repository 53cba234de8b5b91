"""A queue of orders for another process, which may be too busy to take them."""

import threading
from collections import deque
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

__all__ = ["MOST_WAITING", "Outbox"]

#: Orders that are queued in full. Beyond that, only the last one of each name is kept.
MOST_WAITING = 64


class Outbox:
    """Sends orders in a thread of its own, so that the caller never blocks.

    Parameters
    ----------
    connection : Connection
        The other end. When it is broken, orders are discarded.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._orders: deque[tuple[Any, ...]] = deque()
        self._changed = threading.Condition()
        self._closed = False
        threading.Thread(target=self._work, name="board outbox", daemon=True).start()

    def __len__(self) -> int:
        return len(self._orders)

    def put(self, *order: Any) -> None:
        """Queue an order, a name and its arguments."""
        with self._changed:
            if len(self._orders) >= MOST_WAITING:
                older = (waiting for waiting in reversed(self._orders) if waiting[0] == order[0])
                if (superseded := next(older, None)) is not None:
                    self._orders = deque(o for o in self._orders if o is not superseded)
            self._orders.append(order)
            self._changed.notify()

    def close(self) -> None:
        """End the thread. Queued orders are discarded."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _work(self) -> None:
        with suppress(OSError):
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: self._orders or self._closed)
                    if self._closed:
                        return
                    order = self._orders.popleft()
                self._connection.send(order)
