"""A pseudo-terminal: programs open it as they would a serial port."""

import asyncio
import errno
import os
import pty
import select
import termios
import tty
from contextlib import suppress

__all__ = ["Terminal"]

#: Bytes that are read at once.
CHUNK = 64

#: Seconds from one look whether somebody has opened it to the next.
LOOK = 0.02


class Terminal:
    """The machine's end of a pseudo-terminal.

    As with a real port, what comes while nobody has it open is lost, and so is what somebody who
    has it open does not read in time.

    Attributes
    ----------
    path : str
        What programs open.

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
        """Forget who had it open: what was not read, and an echo that would answer the machine."""
        with suppress(OSError, termios.error):
            theirs = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                tty.setraw(theirs, termios.TCSAFLUSH)
            finally:
                os.close(theirs)

    @property
    def open(self) -> bool:
        """Whether somebody has it open."""
        return not any(event & select.POLLHUP for _, event in self._poll.poll(0))

    def close(self) -> None:
        """Let go of it. Who has it open hears the end."""
        if self._ours >= 0:
            os.close(self._ours)
            self._ours = -1

    def write(self, data: bytes) -> None:
        """Send bytes to whoever has it open."""
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
        """Wait for bytes, and give them. It never ends: somebody else may open it."""
        was_open = True
        while True:
            if not self.open:
                # Somebody may have written and closed it since the last look. What is left here
                # would be said in the name of who opens it next.
                if data := self._left():
                    return data
                if was_open:
                    self._renew()
                was_open = False
                await asyncio.sleep(LOOK)
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
        """Give some of what was sent before it was closed."""
        try:
            return os.read(self._ours, CHUNK)
        except OSError:
            return b""

    async def _readable(self) -> None:
        """Wait until there may be something to read."""
        loop, event = asyncio.get_running_loop(), asyncio.Event()
        loop.add_reader(self._ours, event.set)
        try:
            await event.wait()
        finally:
            loop.remove_reader(self._ours)
