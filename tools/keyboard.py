"""Somebody at a keyboard, while a command goes on for long."""

import contextlib
import queue
import signal
import sys
import threading
from collections.abc import Iterator

__all__ = ["Ended", "Keyboard"]


class Ended(Exception):
    """Whoever is at the keyboard wants no more."""


class Keyboard:
    """Someone who may pause a job, go on, or end it.

    Attributes
    ----------
    interrupts : int
        Times that Ctrl-C was pressed, since the last Return.
    """

    def __init__(self) -> None:
        self.interrupts = 0
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Count Ctrl-C instead of breaking off, and read lines if there is a terminal."""
        def count(*_) -> None:
            self.interrupts += 1

        before = signal.signal(signal.SIGINT, count)
        try:
            if sys.stdin is not None and sys.stdin.isatty():
                threading.Thread(target=self._read, args=(sys.stdin,), daemon=True).start()
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _read(self, stream) -> None:
        for line in stream:
            self._lines.put(line.strip().lower())

    def paused(self, paused: bool) -> bool:
        """Return whether the job is paused from now on.

        Raises
        ------
        Ended
            If it was paused and Ctrl-C came again, or for ``q``.
        """
        while not self._lines.empty():
            line = self._lines.get()
            if line == "q":
                raise Ended
            self.interrupts = int(line == "p")
        if self.interrupts > 1:
            raise Ended
        return bool(self.interrupts)
