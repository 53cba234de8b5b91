"""A job for the mill, sent over a port, and over it again when it was gone."""

import os
import time
from collections.abc import Callable
from typing import Protocol

from .errors import LineLost, MachineError
from .orders import Sender
from .port import PSEUDO_TERMINALS, Port

__all__ = ["Line", "LineOpener", "ReopenedPort", "deliver"]

RETRY_S = 0.5
"""Seconds from one try to open a port that is gone to the next."""

STALE_READS = 16
"""Reads at most of what came before anybody asked."""


class Line(Protocol):
    """What `deliver` asks of a `Port`."""

    @property
    def waiting(self) -> bool: ...

    def read(self) -> bytes: ...

    def write(self, data: bytes) -> None: ...


class LineOpener(Protocol):
    """What `deliver` asks of a `ReopenedPort`."""

    def open(self) -> Line: ...

    def close(self) -> None: ...


class ReopenedPort:
    """A serial port that is opened again when it was gone.

    Parameters
    ----------
    name : str or path
        What `Port` takes.
    """

    def __init__(self, name: str | os.PathLike[str]) -> None:
        self.name = os.fspath(name)
        self._port: Port | None = None
        self._opened = False

    def open(self) -> Port:
        """Return the port; open it if it is not.

        Raises
        ------
        LineLost
            If it cannot be opened.
        MachineError
            If it cannot come back by that name.
        """
        if self._port is None:
            if self._opened and self.name.startswith(PSEUDO_TERMINALS):  # anybody's window by now
                raise MachineError(f"{self.name} is gone, and comes back by another name: use the "
                                   "one that python -m tools.serve prints")
            self._port = Port(self.name)
            self._opened = True
        return self._port

    def close(self) -> None:
        """Let go of it. Closing twice does nothing."""
        if self._port is not None:
            self._port.close()
            self._port = None


def deliver(sender: Sender, opener: LineOpener, *,
            watch: Callable[[bool], None] = lambda connected: None,
            clock: Callable[[], float] = time.monotonic,
            rest: Callable[[float], None] = time.sleep) -> None:
    """Send a job over a port, which may be gone at times, until the job is finished.

    Parameters
    ----------
    sender : Sender
        The job.
    opener : ReopenedPort or alike
        Gives the port. The first time it must open; later that is tried until it does. It is left
        open.
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
    line: Line | None = None
    begun = False
    while not sender.finished:
        if begun:
            watch(line is not None)
        try:
            if line is None:
                line = opener.open()
                for _ in range(STALE_READS):  # answers to another program
                    if line.waiting:
                        line.read()
                sender.connected(clock())
                begun = True
            if data := sender.send(clock()):
                line.write(data)
            sender.receive(line.read(), clock())
        except LineLost:
            opener.close()
            if line is None and not begun:
                raise
            line = None
            rest(RETRY_S)
