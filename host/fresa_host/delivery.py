"""A job for the mill, sent over a port, and over another one when that is gone."""

import time
from collections.abc import Callable
from typing import Protocol

from .errors import LineLost
from .orders import Sender

__all__ = ["Line", "deliver"]

AGAIN = 0.5
"""Seconds from one try to open a port that is gone to the next."""


class Line(Protocol):
    """What `deliver` asks of a `Port`."""

    @property
    def waiting(self) -> bool: ...

    def read(self) -> bytes: ...

    def write(self, data: bytes) -> None: ...

    def close(self) -> None: ...


def deliver(sender: Sender, connect: Callable[[], Line], *,
            watch: Callable[[bool], None] = lambda connected: None,
            clock: Callable[[], float] = time.monotonic,
            rest: Callable[[float], None] = time.sleep) -> None:
    """Send a job over a port, and over another one when that is gone, until it is finished.

    Parameters
    ----------
    sender : Sender
        The job.
    connect : callable
        Opens the port. The first time it must succeed; later it is tried until it does.
    watch : callable
        Called often, with whether there is a port. What it raises ends the delivery.
    clock, rest : callable
        Seconds now; waits so many.

    Raises
    ------
    LineLost
        If the port cannot be opened the first time.
    MachineError
        If the job cannot go on.
    """
    port: Line | None = None
    begun = False
    try:
        while not sender.finished:
            if begun:
                watch(port is not None)
            try:
                if port is None:
                    port = connect()
                    while port.waiting:  # answers to somebody else
                        port.read()
                    sender.connected(clock())
                    begun = True
                if line := sender.send(clock()):
                    port.write(line)
                sender.receive(port.read(), clock())
            except LineLost:
                if not begun:
                    raise
                if port is not None:
                    port.close()
                port = None
                rest(AGAIN)
    finally:
        if port is not None:
            port.close()
