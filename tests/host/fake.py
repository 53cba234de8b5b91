"""A port with something at its other end that says what a test wants."""

import threading
import time
from collections.abc import Callable

from fresa_host import LineLost

__all__ = ["BREAK", "FakePort"]

BREAK = b"(break)"


class FakePort:
    """A port. What is written to it is answered by a function, if at all.

    Parameters
    ----------
    answer : callable
        Given a line or frame with its end, gives what comes back.
    ends : bytes
        What ends one.

    Attributes
    ----------
    written : list of bytes
        What was written, line by line, and `BREAK` for a break.
    can_break : bool
        Whether it can send one.
    pause : float
        Seconds that a read waits.
    """

    name = "fake"
    baud = 10**6

    def __init__(self, answer: Callable[[bytes], bytes], ends: bytes = b"\n") -> None:
        self.answer, self.ends = answer, ends
        self.written: list[bytes] = []
        self.coming = b""
        self.pause = 0.002
        self.gone = self.closed = self.can_break = False
        self._lock = threading.Lock()

    @property
    def waiting(self) -> bool:
        return bool(self.coming)

    def say(self, data: bytes) -> None:
        """Let something come that nobody asked for."""
        with self._lock:
            self.coming += data

    def idle(self) -> None:
        """Let some time pass."""
        time.sleep(self.pause)

    def read(self) -> bytes:
        self.idle()
        if self.gone:
            raise LineLost("fake is gone: unplugged")
        with self._lock:
            data, self.coming = self.coming[:7], self.coming[7:]
        return data

    def write(self, data: bytes) -> None:
        for part in data.splitlines(keepends=True):
            assert part.endswith(self.ends)
            self.written.append(part)
            self.say(self.answer(part))

    def send_break(self) -> None:
        if self.can_break:
            self.written.append(BREAK)
            self.broken()

    def broken(self) -> None:
        """Hear a break."""

    def close(self) -> None:
        self.closed = True
