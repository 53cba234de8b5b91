"""Pause, continue and end a long job from the keyboard."""

import contextlib
import queue
import signal
import sys
import threading
from collections.abc import Iterator

__all__ = ["Ended", "Keyboard"]


class Ended(Exception):
    """The user has ended the job."""


class Keyboard:
    """A user who may pause, continue or end a job.

    Attributes
    ----------
    interrupts : int
        Number of times that Ctrl-C was pressed since the last Return.
    """

    def __init__(self) -> None:
        self.interrupts = 0
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    @contextlib.contextmanager
    def listening(self) -> Iterator[None]:
        """Count Ctrl-C instead of raising, and read lines if there is a terminal."""
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
        """Return whether the job is paused now.

        Raises
        ------
        Ended
            If Ctrl-C was pressed while paused, or ``q`` was entered.
        """
        while not self._lines.empty():
            line = self._lines.get()
            if line == "q":
                raise Ended
            self.interrupts = int(line == "p")
        if self.interrupts > 1:
            raise Ended
        return bool(self.interrupts)
