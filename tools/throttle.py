"""Clocks due at a given speed: slow motion without drift."""

from collections import deque

__all__ = ["CATCH_UP", "Rate", "Throttle"]

#: Seconds that may be caught up; after a longer delay the schedule starts again.
CATCH_UP = 0.25

#: Least seconds between two short runs: shorter rests would only keep the processor busy.
LEAST_REST_S = 0.004

#: Due when there is no limit.
WITHOUT_END = 1 << 40


class Throttle:
    """A schedule of clocks at a given speed, or without a limit.

    Attributes
    ----------
    speed : float or None
        Clocks a second; None for no limit.
    restarts : int
        How often the schedule has started again, `CATCH_UP` seconds late or more.
    """

    def __init__(self) -> None:
        self.speed: float | None = None
        self.restarts = 0
        self._start = 0.0
        self._clocks = 0
        self._last_run = 0.0

    def begin(self, now: float) -> None:
        """Start the schedule at a time in seconds: nothing is due."""
        self._start, self._clocks = now, 0

    def due(self, now: float) -> int:
        """Return the clocks that are due at a time in seconds."""
        if self.speed is None:
            return WITHOUT_END
        due = int((now - self._start) * self.speed) - self._clocks
        if due > 1 + self.speed * CATCH_UP:
            self.restarts += 1
            self.begin(now - 1 / self.speed)
            return 1
        return due

    def made(self, clocks: int, now: float) -> None:
        """Count clocks as made, at a time in seconds."""
        self._clocks += clocks
        self._last_run = now

    def wait(self, now: float) -> float:
        """Return the seconds until enough clocks are due to be worth a run."""
        if self.speed is None:
            return 0.0
        due = self._start + (self._clocks + 1) / self.speed
        # A schedule that is behind by that rest or more takes none.
        rested = min(self._last_run, self._start + self._clocks / self.speed) + LEAST_REST_S
        return max(0.0, max(due, rested) - now)


class Rate:
    """Clocks per second, over the last moments."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, int]] = deque()

    def clear(self) -> None:
        """Discard the samples."""
        self._samples.clear()

    def update(self, now: float, clock: int, span: float = 1.0) -> float:
        """Add a sample, a time in seconds and the clock; return clocks/s over the last `span` s."""
        self._samples.append((now, clock))
        while len(self._samples) > 2 and self._samples[1][0] < now - span:
            self._samples.popleft()
        (first, at), (last, to) = self._samples[0], self._samples[-1]
        return (to - at) / (last - first) if last > first else 0.0
