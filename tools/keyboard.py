"""Somebody at a keyboard, while a command goes on for long."""

import contextlib
import queue
import signal
import sys
import threading
from collections.abc import Iterator

__all__ = ["Ended", "Keyboard"]


POLL_S = 0.1
"""Seconds from one look for Ctrl-C to the next, while an answer is awaited."""


class Ended(Exception):
    """Whoever is at the keyboard wants no more."""


class Keyboard:
    """Someone who may pause a job, go on, or end it.

    Attributes
    ----------
    interrupts : int
        Times that Ctrl-C was pressed, since the last Return.
    present : bool
        Lines are read from a terminal, so that what is paused can go on.
    """

    def __init__(self) -> None:
        self.interrupts = 0
        self.present = False
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Count Ctrl-C instead of breaking off, and read lines if there is a terminal."""
        def count(*_) -> None:
            self.interrupts += 1

        before = signal.signal(signal.SIGINT, count)
        try:
            if sys.stdin is not None and sys.stdin.isatty():
                self.present = True
                threading.Thread(target=self._read, args=(sys.stdin,), daemon=True).start()
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _read(self, stream) -> None:
        for line in stream:
            self._lines.put(line.strip().lower())
        self.present = False

    def confirms(self) -> bool:
        """Wait for a line, and return whether it says yes. Ctrl-C, or no terminal, says no."""
        while self.present and not self.interrupts:
            with contextlib.suppress(queue.Empty):
                return self._lines.get(timeout=POLL_S) in ("y", "yes")
        return False

    def paused(self, paused: bool) -> bool:
        """Return whether the job is paused from now on.

        Raises
        ------
        Ended
            If Ctrl-C came and there is no terminal to go on from, or it was paused and Ctrl-C came
            again, or for ``q``.
        """
        while not self._lines.empty():
            line = self._lines.get()
            if line == "q":
                raise Ended
            self.interrupts = int(line == "p")
        if self.interrupts > (1 if self.present else 0):
            raise Ended
        return bool(self.interrupts)
