"""Models of motor drivers; positions are integers, times are clock numbers."""

from collections.abc import Sequence

__all__ = ["PhaseModel", "RateModel", "StepDirModel"]


class PhaseModel:
    """Coils that step through `sequence`, with each word for at least `period` clocks."""

    def __init__(self, *, sequence: Sequence[int], period: int) -> None:
        self.sequence, self.period = sequence, period
        self.place = 0  # steps forward minus steps back
        self.now, self.since = 0, 0  # the clock; the clock of the last change
        self.coils = 0

    def clock(self, *, step: int, direction: int, enable: int, rst: int = 0) -> dict[str, int]:
        """Advance one clock."""
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


class StepDirModel:
    """Three pins, and when each may change: after a change of one, all wait.

    With `width_now` a pulse lasts so long.
    """

    def __init__(self, *, width: int, low: int, setup: int, hold: int) -> None:
        self.width, self.pause, self.setup = width, max(low, hold), setup
        self.pulse = self.sense = self.power = 0
        self.now, self.free = 0, max(width, low, setup, hold) - 1  # clock; that of the next change

    def clock(self, *, step: int, direction: int, enable: int, rst: int = 0,
              width_now: int | None = None) -> dict[str, int]:
        """Advance one clock."""
        free = self.now >= self.free
        right = self.sense == direction and self.power == enable
        ready = int(free and not self.pulse and right and enable and not rst)
        seen = {"ready": ready, "moved": ready & step, "step_pin": self.pulse,
                "direction_pin": self.sense, "enable_pin": self.power}
        if free and self.pulse:
            self.pulse, self.free = 0, self.now + self.pause
        elif seen["moved"]:
            self.pulse, self.free = 1, self.now + (width_now or self.width)
        elif free and (self.power != enable or step and not right):
            self.sense = direction if step else self.sense
            self.power, self.free = enable, self.now + self.setup
        self.now += 1
        return seen


class RateModel:
    """Step times in integers: the sum of the rates, and the steps made of it.

    Where a step waits, the sum is just what the step takes.
    """

    def __init__(self, *, modulus: int, max_rate: int) -> None:
        self.modulus, self.max_rate = modulus, max_rate
        self.given, self.made = modulus, 0

    def is_due(self) -> bool:
        """Return whether a step is due."""
        return self.given >= (self.made + 1) * self.modulus

    def clock(self, *, rate: int, moved: int, rst: int = 0) -> dict[str, int]:
        """Advance one clock."""
        due = int(self.is_due())
        if moved or not due:
            self.given += min(rate, self.max_rate)
        else:
            self.given = (self.made + 1) * self.modulus
        self.made += due & moved
        return {"due": due}
