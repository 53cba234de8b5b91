"""Drivers of motors in plain Python: places are whole numbers, times are clock numbers."""

from collections.abc import Sequence

__all__ = ["PhaseModel"]


class PhaseModel:
    """Coils that go through `sequence`, and have each word for `period` clocks or more."""

    def __init__(self, *, sequence: Sequence[int], period: int) -> None:
        self.sequence, self.period = sequence, period
        self.place = 0  # steps forward less steps back
        self.now, self.since = 0, 0  # the clock; that from which on the coils have their word
        self.coils = 0

    def clock(self, *, step: int, direction: int, enable: int, rst: int = 0) -> dict[str, int]:
        """Make a clock."""
        held = self.now - self.since + 1 if self.coils else 0
        ready = int(enable and not rst and held >= self.period)
        seen = {"ready": ready, "moved": ready & step, "coils": self.coils}
        self.now += 1
        if seen["moved"]:
            self.place += 1 if direction else -1
        if seen["moved"] or not self.coils:
            self.since = self.now
        self.coils = self.sequence[self.place % len(self.sequence)] if enable else 0
        return seen
