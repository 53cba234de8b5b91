"""A simulated machine and its serial line, run in a thread at a given speed."""

import threading
import time
from collections.abc import Callable

from tb.engines import Engine
from tb.uart import SerialLine

from ..throttle import CATCH_UP, Throttle

__all__ = ["MOST_WAITING", "Running"]

#: Most queued bytes to the machine: at 115 200 baud those of two runs.
MOST_WAITING = 256

#: Seconds that a run should take, and clocks of the first run.
SLICE = 0.01
FIRST_SLICE = 1000

#: Seconds that simulated time may be behind in all before that is said.
LATE_S = 2

#: Seconds between checks whether to stop, if nothing else happens.
IDLE = 0.02


class Running:
    """A running machine.

    Parameters
    ----------
    engine : Engine
        The machine, at power-up. It is closed at the end.
    period : int
        Clocks per bit of its serial line.
    speed : float or None
        Clocks per second; None for no limit.
    on_data : callable
        Called in the thread after each run, with the bytes that the machine has sent, if any, and
        the free places of the queue to it.
    ended : callable
        Called in the thread at its end, with the error if there was one.
    behind : callable
        Called in the thread once, when clocks of `LATE_S` seconds were never made.
    """

    def __init__(self, engine: Engine, period: int, *, speed: float | None,
                 on_data: Callable[[bytes, int], None],
                 ended: Callable[[Exception | None], None],
                 behind: Callable[[], None]) -> None:
        self._engine, self._on_data, self._ended, self._behind = engine, on_data, ended, behind
        self._line = SerialLine(engine, period)
        self._throttle = Throttle()
        self._throttle.speed = speed
        self._slice = FIRST_SLICE
        self._lock = threading.Lock()
        self._queued = bytearray()
        self._levels: dict[str, int] = {}
        self._break = False
        self._late = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)

    @property
    def clock(self) -> int:
        """Clocks made."""
        return self._engine.clock

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the machine, and wait for its end."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()

    def send(self, data: bytes) -> int:
        """Queue bytes to the machine; return how many were accepted."""
        with self._lock:
            room = MOST_WAITING - len(self._queued) - self._line.waiting
            taken = data[:max(0, room)]
            self._queued += taken
            return len(taken)

    def send_break(self) -> None:
        """Hold the line to the machine low for two bytes' time, before the queued bytes."""
        with self._lock:
            self._break = True

    def set(self, **levels: int) -> None:
        """Set inputs of the machine, with the next run."""
        with self._lock:
            self._levels |= levels

    def _work(self) -> None:
        error = None
        try:
            self._throttle.begin(time.monotonic())
            while not self._stopping.wait(min(IDLE, self._throttle.wait(time.monotonic()))):
                self._advance()
        except Exception as failure:  # reported to `ended`
            error = failure
        finally:
            self._engine.close()
            self._ended(error)

    def _advance(self) -> None:
        start = time.monotonic()
        clocks = min(self._throttle.due(start), self._slice)
        if not self._late and self._throttle.restarts * CATCH_UP >= LATE_S:
            self._late = True
            self._behind()
        if clocks < 1:
            return
        with self._lock:
            if self._break:
                self._line.send_break()
            self._line.send(bytes(self._queued))
            self._engine.set(**self._levels)
            self._queued.clear()
            self._levels.clear()
            self._break = False
        sent = self._line.run(clocks)
        end = time.monotonic()
        self._throttle.made(clocks, end)
        if clocks == self._slice:
            ratio = SLICE / max(end - start, 1e-6)
            self._slice = max(1, round(clocks * min(2.0, max(0.1, ratio))))
        with self._lock:
            room = MOST_WAITING - len(self._queued) - self._line.waiting
        self._on_data(sent, room)
