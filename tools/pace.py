"""How many clocks are due, and how many were made: slow motion without drift."""

from collections import deque

__all__ = ["Pace", "Rate"]

#: Seconds that may be caught up. Whoever is later than that has lost the time.
CATCH_UP = 0.25

#: Seconds between two short runs: less would only keep the processor busy.
BREATH = 0.004

#: Due when there is no limit.
WITHOUT_END = 1 << 40


class Pace:
    """A schedule of so many clocks a second, or of as many as can be made.

    Attributes
    ----------
    speed : float or None
        Clocks a second; None for no limit.
    """

    def __init__(self) -> None:
        self.speed: float | None = None
        self._begun = 0.0
        self._made = 0
        self._ran = 0.0

    def begin(self, now: float) -> None:
        """Begin the schedule at a time in seconds: nothing is due."""
        self._begun, self._made = now, 0

    def due(self, now: float) -> int:
        """Give the clocks that should have been made by now, but were not."""
        if self.speed is None:
            return WITHOUT_END
        due = int((now - self._begun) * self.speed) - self._made
        if due > 1 + self.speed * CATCH_UP:
            self.begin(now - 1 / self.speed)
            return 1
        return due

    def made(self, clocks: int, now: float) -> None:
        """Count clocks as made."""
        self._made += clocks
        self._ran = now

    def wait(self, now: float) -> float:
        """Give the seconds until more is due that is worth a run."""
        if self.speed is None:
            return 0.0
        due = self._begun + (self._made + 1) / self.speed
        # Whoever is behind by a breath or more takes none.
        rested = min(self._ran, self._begun + self._made / self.speed) + BREATH
        return max(0.0, max(due, rested) - now)


class Rate:
    """Clocks a second, of late."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def clear(self) -> None:
        """Forget what was seen."""
        self._seen.clear()

    def see(self, now: float, clock: int, span: float = 1.0) -> float:
        """Note the clock at a time in seconds; give the rate over the last `span` of them."""
        self._seen.append((now, clock))
        while len(self._seen) > 2 and self._seen[1][0] < now - span:
            self._seen.popleft()
        (first, at), (last, to) = self._seen[0], self._seen[-1]
        return (to - at) / (last - first) if last > first else 0.0
