"""The process of the gateware, seen from the server's process."""

import asyncio
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from .outbox import Outbox
from .worker import work

__all__ = ["Simulation"]

#: Seconds within which the process must end by itself.
STOP_TIMEOUT_S = 2.0


class Simulation:
    """A process with a machine in it. It may end at any time, and can be started again.

    Parameters
    ----------
    engine : str, optional
        The engine; None for the fastest available.
    on_message : callable
        Called in the event loop with the messages of the process, tuples of `tools.board.worker`,
        and with ``("ended", status)`` when it has ended.
    folder : str
        A folder that the process deletes if this one is killed.
    """

    def __init__(self, engine: str | None, on_message: Callable[..., None], folder: str) -> None:
        self._engine, self._on_message, self._folder = engine, on_message, folder
        self._process: BaseProcess | None = None
        self._connection: Connection | None = None
        self._outbox: Outbox | None = None

    @property
    def alive(self) -> bool:
        """Whether it takes messages."""
        return self._connection is not None

    @property
    def pid(self) -> int | None:
        """Its process id."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start the process, with no machine in it yet."""
        context = multiprocessing.get_context("spawn")
        ours, its = context.Pipe()
        process = context.Process(target=work, args=(its, self._engine, self._folder),
                                  daemon=True)
        with _ignore_sigint():
            process.start()
        its.close()
        self._process, self._connection, self._outbox = process, ours, Outbox(ours)
        threading.Thread(target=_listen, name="board listener", daemon=True, args=(
            ours, process, asyncio.get_running_loop(), self._receive)).start()

    def send(self, *order: Any) -> None:
        """Send an order. If the process has ended nothing happens; its end is reported anyway."""
        if self._outbox is not None:
            self._outbox.put(*order)

    def _receive(self, connection: Connection, *message: Any) -> None:
        if connection is not self._connection:
            return  # a process before: its messages no longer count
        if message[0] == "ended":
            if self._outbox is not None:
                self._outbox.close()
            connection.close()
            self._connection = self._outbox = None
        self._on_message(*message)

    def stop(self) -> None:
        """End the process and all that it started, by force after a timeout."""
        process, outbox = self._process, self._outbox
        self._process = self._connection = self._outbox = None
        if process is None:
            return
        if outbox is not None:
            outbox.put("quit")
        process.join(STOP_TIMEOUT_S)
        if outbox is not None:
            outbox.close()
        if process.is_alive() and process.pid is not None:
            with suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
            process.kill()
            process.join()


@contextmanager
def _ignore_sigint() -> Iterator[None]:
    """Start child processes with SIGINT ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _listen(
    connection: Connection, process: BaseProcess, loop: asyncio.AbstractEventLoop,
    receive: Callable[..., None],
) -> None:
    """Forward messages of a connection to the event loop, until it is closed."""
    with suppress(RuntimeError):  # the loop has ended
        while True:
            try:
                message = connection.recv()
            except (EOFError, OSError):
                process.join(STOP_TIMEOUT_S)
                loop.call_soon_threadsafe(receive, connection, "ended", process.exitcode)
                return
            loop.call_soon_threadsafe(receive, connection, *message)
