"""A machine that runs in a thread, as fast as it should, with its serial line."""

import threading
import time
from collections.abc import Callable

from tb.engines import Engine
from tb.uart import SerialLine

from ..pace import Pace

__all__ = ["MOST_WAITING", "Running"]

#: Bytes to the machine that wait, at most: at 9600 baud they take a quarter of a second.
MOST_WAITING = 256

#: Seconds that a run of clocks should take, and how many to begin with.
SLICE = 0.01
FIRST_SLICE = 1000

#: Seconds after which it looks whether it shall end, if nothing else happens.
IDLE = 0.02


class Running:
    """A machine that runs.

    Parameters
    ----------
    engine : Engine
        The machine, at power-up. It is closed when this ends.
    period : int
        Clocks of a bit of its serial line.
    speed : float or None
        Clocks a second; None for as many as can be made.
    heard : callable
        Called in the thread, often: with the bytes that the machine has sent, maybe none, and how
        many more it can be given.
    ended : callable
        Called in the thread when it ends, with the error if that was the reason.
    """

    def __init__(self, engine: Engine, period: int, *, speed: float | None,
                 heard: Callable[[bytes, int], None],
                 ended: Callable[[Exception | None], None]) -> None:
        self._engine, self._heard, self._ended = engine, heard, ended
        self._line = SerialLine(engine, period)
        self._pace = Pace()
        self._pace.speed = speed
        self._slice = FIRST_SLICE
        self._lock = threading.Lock()
        self._given = bytearray()
        self._levels: dict[str, int] = {}
        self._break = False
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)

    @property
    def clock(self) -> int:
        """Clocks made."""
        return self._engine.clock

    def start(self) -> None:
        """Switch the machine on."""
        self._thread.start()

    def stop(self) -> None:
        """Switch it off, and wait until it is."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()

    def send(self, data: bytes) -> int:
        """Give the machine bytes; say how many of them there was room for."""
        with self._lock:
            room = MOST_WAITING - len(self._given) - self._line.waiting
            taken = data[:max(0, room)]
            self._given += taken
            return len(taken)

    def send_break(self) -> None:
        """Hold the line to the machine low for a moment, before what it was given and waits."""
        with self._lock:
            self._break = True

    def set(self, **levels: int) -> None:
        """Set inputs of the machine, by and by."""
        with self._lock:
            self._levels |= levels

    def _work(self) -> None:
        error = None
        try:
            self._pace.begin(time.monotonic())
            while not self._over.wait(min(IDLE, self._pace.wait(time.monotonic()))):
                self._advance()
        except Exception as failure:  # whoever serves the machine must hear of it
            error = failure
        finally:
            self._engine.close()
            self._ended(error)

    def _advance(self) -> None:
        start = time.monotonic()
        clocks = min(self._pace.due(start), self._slice)
        if clocks < 1:
            return
        with self._lock:
            if self._break:
                self._line.send_break()
            self._line.send(bytes(self._given))
            self._engine.set(**self._levels)
            self._given.clear()
            self._levels.clear()
            self._break = False
        said = self._line.run(clocks)
        end = time.monotonic()
        self._pace.made(clocks, end)
        if clocks == self._slice:
            ratio = SLICE / max(end - start, 1e-6)
            self._slice = max(1, round(clocks * min(2.0, max(0.1, ratio))))
        with self._lock:
            room = MOST_WAITING - len(self._given) - self._line.waiting
        self._heard(said, room)
