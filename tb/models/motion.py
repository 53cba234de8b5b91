"""Models of motion: requested steps, backlash, limit switches, positions."""

from collections.abc import Sequence

from .drive import RateModel, StepDirModel

__all__ = ["AxisModel", "BacklashModel", "LimitsModel", "MoveToModel", "RampModel"]


class BacklashModel:
    """A motor and its load; `wall` is the position at which it pushes the load ahead."""

    def __init__(self) -> None:
        self.motor, self.wall, self.way = 0, 0, -1

    def clock(self, *, backlash: int, moved: int, direction: int, rst: int = 0) -> dict[str, int]:
        """Advance one clock."""
        way = 1 if direction else -1
        wall = self.wall
        # the other end of the backlash, or this position if it is past that
        if way != self.way:
            wall = max(wall - backlash * self.way, self.motor, key=lambda place: place * way)
        counted = moved and wall == self.motor
        if moved:
            self.motor += way
            self.way, self.wall = way, wall + way if counted else wall
        return {"counted": int(counted)}


class LimitsModel:
    """Limit switches, debounced by ticks: a release counts at the second tick."""

    def __init__(self, *, axes: int, period: int) -> None:
        self.axes, self.period = axes, period
        self.now = 0
        self.last = {(name, axis): -2 * period for name in ("low", "high") for axis in range(axes)}

    def clock(self, *, low: int, high: int, rst: int = 0) -> dict[str, int]:
        """Advance one clock."""
        switches = {"low": low, "high": high}
        seen = {"at_low": 0, "at_high": 0}
        for axis in range(self.axes):
            for name, levels in switches.items():
                if levels >> axis & 1:
                    self.last[name, axis] = self.now
                if self.now // self.period - self.last[name, axis] // self.period < 2:
                    seen[f"at_{name}"] |= 1 << axis
        self.now += 1
        return seen


class MoveToModel:
    """A position, as an integer. The request depends on the state only, not on its result."""

    def __init__(self, *, width: int) -> None:
        self.width = width
        self.position = 0

    def request(self, *, target: int, run: int, load: int) -> tuple[int, int]:
        """Return the requested step in this clock, and its direction."""
        return int(run and not load and target != self.position), int(target >= self.position)

    def clock(self, *, moved: int, direction: int, load: int, place: int, rst: int) -> None:
        """Advance one clock."""
        if rst:
            self.position = 0
        elif load:
            self.position = place
        elif moved:
            self.position += 1 if direction else -1


class AxisModel:
    """An axis with the pins of a driver module: position, backlash and pulses.

    `times` are those of the driver module.
    """

    def __init__(self, *, times: dict[str, int], modulus: int, max_rate: int,
                 width: int = 32) -> None:
        self.move = MoveToModel(width=width)
        self.seen: tuple[int, int] = 0, 0  # whether a step is wanted, by the clock before; which
        self.rate = RateModel(modulus=modulus, max_rate=max_rate)
        self.driver = StepDirModel(**times)
        self.backlash = BacklashModel()

    def clock(self, *, target: int, run: int, load: int, place: int, rate: int, backlash: int,
              enable: int, low: int, high: int, rst: int = 0) -> dict[str, int]:
        """Advance one clock."""
        position = self.move.position
        now, towards = int(position != target), int(target >= position)
        wanted, direction = self.seen
        due = wanted & run & ~load & int(self.rate.is_due())
        allowed = due & ~(high if direction else low)
        seen = self.driver.clock(step=allowed, direction=direction, enable=enable, rst=rst)
        moved = seen["moved"]
        self.rate.clock(rate=rate, moved=moved)
        counted = self.backlash.clock(backlash=backlash, moved=moved,
                                      direction=direction)["counted"]
        self.move.clock(moved=counted, direction=direction, load=load, place=place, rst=rst)
        del seen["ready"]
        self.seen = (now & run & ~load & ~moved & ~rst, towards & ~rst)
        return {**seen, "position": position, "in_position": int(not now),
                "limit_hit": due & ~allowed & now & (towards == direction)}


class RampModel:
    """A position and a speed, which is limited by the steps that stopping takes.

    `steps` are the rates of the steps from standstill.
    """

    def __init__(self, *, steps: Sequence[int], width: int) -> None:
        self.steps, self.place = steps, MoveToModel(width=width)
        self.level, self.way = 0, 1
        self.now = 0

    def request(self, *, target: int, run: int) -> tuple[int, int]:
        """Return the requested step in this clock, and its direction."""
        if self.level == 0:
            return self.place.request(target=target, run=run, load=0)
        return run, int(self.way > 0)

    def bounds(self) -> tuple[int, int]:
        """Return the slowest and the fastest rate."""
        rates = [0, self.steps[0], *self.steps]
        return rates[self.level], rates[self.level + 1]

    def rate(self, requested_rate: int) -> int:
        """Return the rate in this clock."""
        slowest, fastest = self.bounds()
        return sorted((slowest, requested_rate, fastest))[1] if self.now else 0

    def clock(self, *, target: int, run: int, requested_rate: int, moved: int,
              rst: int = 0) -> None:
        """Advance one clock."""
        _, direction = self.request(target=target, run=run)
        slowest, fastest = self.bounds()
        if moved:
            self.way = 1 if direction else -1
        self.place.clock(moved=moved, direction=direction, load=0, place=0, rst=rst)
        self.now += 1
        if not run or rst:
            self.level = 0
        elif moved:
            ahead = (target - self.place.position) * self.way
            if self.level and (ahead < self.level or requested_rate <= slowest):
                self.level -= 1
            elif ahead > self.level and requested_rate > fastest and self.level < len(self.steps):
                self.level += 1
