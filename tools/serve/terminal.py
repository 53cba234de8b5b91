"""A pseudo-terminal, which programs open like a serial port."""

import asyncio
import errno
import os
import pty
import select
import termios
import tty
from contextlib import suppress

__all__ = ["Terminal"]

#: Bytes of a read.
CHUNK = 64

#: Seconds between checks whether a program has opened it.
POLL_S = 0.02


class Terminal:
    """The machine's end of a pseudo-terminal.

    As with a real port, data is lost while no program has it open, or if the program does not read
    it in time.

    Attributes
    ----------
    path : str
        The path that programs open.

    Raises
    ------
    OSError
        If the system has no pseudo-terminal.
    """

    def __init__(self) -> None:
        self._ours, theirs = pty.openpty()
        self.path = os.ttyname(theirs)
        os.close(theirs)
        os.set_blocking(self._ours, False)
        self._poll = select.poll()
        self._poll.register(self._ours, 0)
        self._renew()

    def _renew(self) -> None:
        """Discard unread data, and switch off echo, which would send data back to the machine."""
        with suppress(OSError, termios.error):
            theirs = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                tty.setraw(theirs, termios.TCSAFLUSH)
            finally:
                os.close(theirs)

    @property
    def open(self) -> bool:
        """Whether a program has it open."""
        return not any(event & select.POLLHUP for _, event in self._poll.poll(0))

    def close(self) -> None:
        """Close it. The program that has it open reads an end of file."""
        if self._ours >= 0:
            os.close(self._ours)
            self._ours = -1

    def write(self, data: bytes) -> None:
        """Send bytes to the program that has it open."""
        if self._ours < 0 or not self.open:
            return
        for _ in range(2):
            try:
                data = data[os.write(self._ours, data):]
            except BlockingIOError:
                pass
            except OSError as error:
                if error.errno != errno.EIO:
                    raise
                return
            if not data:
                return
            with suppress(termios.error):
                termios.tcflush(self._ours, termios.TCOFLUSH)

    async def read(self) -> bytes:
        """Wait for bytes, and return them. It never ends: another program may open it."""
        was_open = True
        while True:
            if not self.open:
                # A program may have written and closed it since the last check. Its data must not
                # be mixed with that of the next program.
                if data := self._left():
                    return data
                if was_open:
                    self._renew()
                was_open = False
                await asyncio.sleep(POLL_S)
                continue
            was_open = True
            try:
                if data := os.read(self._ours, CHUNK):
                    return data
            except BlockingIOError:
                await self._readable()
            except OSError as error:
                if error.errno != errno.EIO:
                    raise

    def _left(self) -> bytes:
        """Return some of the data that was sent before it was closed."""
        try:
            return os.read(self._ours, CHUNK)
        except OSError:
            return b""

    async def _readable(self) -> None:
        """Wait until it may be readable."""
        loop, event = asyncio.get_running_loop(), asyncio.Event()
        loop.add_reader(self._ours, event.set)
        try:
            await event.wait()
        finally:
            loop.remove_reader(self._ours)
