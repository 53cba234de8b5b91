"""The serial line of a simulated machine, shared by a pseudo-terminal and TCP connections.

All clients receive what the machine sends. They send one at a time: a line that has begun is passed
on to its end, so that lines never mix. A client that pauses, or whose line has no end, loses its
turn. Data that comes faster than the line waits in the client.
"""

import asyncio
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from functools import partial

from tb.engines import Engine

from ..console import UserError, warn
from .running import Running
from .terminal import Terminal

__all__ = ["HOST", "Service", "check_port"]

HOST = "127.0.0.1"

MOST_CLIENTS = 16

#: Bytes of a read, and of the longest line that others wait for.
CHUNK = 64
LONGEST_LINE = 256

#: Seconds within which a line that has begun must continue.
LINE_TIMEOUT_S = 1.0

#: Most unsent bytes to a client before its connection is closed.
MOST_UNREAD = 1 << 16

ENDS = (b"\r", b"\n")

#: What is said once when less is simulated than the speed asks for.
BEHIND = ("simulated time has fallen seconds behind: this computer is busy, or too slow for the "
          "machine at this speed; what the machine does is right all the same, only later")


def check_port(port: int) -> None:
    """Raise `UserError` if a TCP port is in use, before a machine is built for it."""
    with socket.socket() as found:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as a server does
        try:
            found.bind((HOST, port))
        except OSError as error:
            raise _taken(port) from error


def _taken(port: int | None) -> UserError:
    return UserError(f"port {port} is not available: choose another with --tcp, or 0 for any free "
                     "one")


class Service:
    """A machine and its serial line, served on this computer, as an asynchronous context manager.

    Parameters
    ----------
    engine : Engine
        The machine, at power-up; it is closed at the end.
    period : int
        Clocks per bit of its serial line.
    speed : float or None
        Clocks per second; None for no limit.
    port : int, optional
        TCP port of the loopback, 0 for any free one. None for no TCP.

    Attributes
    ----------
    path : str
        Path of the pseudo-terminal.
    port : int or None
        The TCP port.
    ended : asyncio.Future
        Done when the machine has ended by itself; the result is the reason.

    Raises
    ------
    UserError
        If there is no pseudo-terminal, or the port is in use.
    """

    def __init__(self, engine: Engine, period: int, *, speed: float | None,
                 port: int | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        self.ended: asyncio.Future[str] = self._loop.create_future()
        self._running = Running(engine, period, speed=speed,
                                on_data=self._from_thread(self._on_data),
                                ended=self._from_thread(self._on_end),
                                behind=self._from_thread(partial(warn, BEHIND)))
        try:
            self._terminal = Terminal()
        except OSError as error:
            engine.close()
            raise UserError(f"no pseudo-terminal is available: {error.strerror}") from error
        self.path = self._terminal.path
        self.port = port
        self._server: asyncio.Server | None = None
        self._clients: dict[asyncio.StreamWriter, asyncio.Task | None] = {}
        self._turn = asyncio.Lock()
        self._room = asyncio.Event()
        self._tasks: set[asyncio.Task] = set()

    async def __aenter__(self) -> "Service":
        try:
            if self.port is not None:
                self._server = await asyncio.start_server(self._client, HOST, self.port,
                                                          limit=2 * CHUNK)
                self.port = self._server.sockets[0].getsockname()[1]
        except OSError as error:
            await self._close()
            raise _taken(self.port) from error
        self._tasks.add(asyncio.create_task(self._forward(self._terminal.read)))
        self._running.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._close()

    async def _close(self) -> None:
        if self._server is not None:
            self._server.close()
        for writer in self._clients:
            writer.transport.abort()
        tasks = [*self._tasks, *filter(None, self._clients.values())]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.to_thread(self._running.stop)
        self._terminal.close()

    def send_break(self) -> None:
        """Hold the line to the machine low for two bytes' time, whatever is being sent."""
        self._running.send_break()

    def set(self, **levels: int) -> None:
        """Set inputs of the machine."""
        self._running.set(**levels)

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve a TCP connection until it is closed."""
        if len(self._clients) >= MOST_CLIENTS:
            writer.write(b"! too many connections\r\n")
            writer.close()
            return
        self._clients[writer] = asyncio.current_task()
        try:
            await self._forward(lambda: reader.read(CHUNK))
        except (ConnectionError, asyncio.CancelledError):
            pass
        finally:
            del self._clients[writer]
            with suppress(ConnectionError):
                writer.close()

    async def _forward(self, read: Callable[[], Awaitable[bytes]]) -> None:
        """Pass on a client's data, a line at a time, until it ends."""
        rest = b""
        while data := rest or await read():
            async with self._turn:
                count, rest = 0, b""
                while True:
                    ended = max(map(data.rfind, ENDS)) + 1
                    # The rest, a line that has begun, waits for the next turn.
                    data, rest = (data[:ended], data[ended:]) if ended else (data, b"")
                    await self._send(data)
                    count += len(data)
                    if ended or count >= LONGEST_LINE:
                        break
                    try:
                        data = await asyncio.wait_for(read(), LINE_TIMEOUT_S)
                    except TimeoutError:
                        break
                    if not data:
                        return

    async def _send(self, data: bytes) -> None:
        while data := data[self._running.send(data):]:
            self._room.clear()
            await self._room.wait()

    # Called from the thread of the machine

    def _from_thread(self, call: Callable[..., None]) -> Callable[..., None]:
        def later(*arguments: object) -> None:
            with suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(call, *arguments)

        return later

    def _on_data(self, data: bytes, room: int) -> None:
        if room:
            self._room.set()
        if not data:
            return
        self._terminal.write(data)
        for writer in self._clients:
            if writer.transport.get_write_buffer_size() > MOST_UNREAD:
                writer.transport.abort()
            elif not writer.is_closing():
                writer.write(data)

    def _on_end(self, error: Exception | None) -> None:
        if not self.ended.done():
            self.ended.set_result("the machine has ended" if error is None
                                  else f"the machine has ended: {type(error).__name__}: {error}")
