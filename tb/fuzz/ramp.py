"""A motor with a ramp: its steps, counted at the pins, against what the ramp lets it do.

After how many steps it can stand is its level. That is not seen: it follows from the steps before,
from what was requested with each, and from their times. Where it is not known to the clock when
something was requested, all that may be is followed.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .trajectory import NEVER, Effect, Failure, Mode, Steps, TrajectoryCheck, intervals

__all__ = ["Ramp", "check_ramp"]


class Ramp:
    """What a ramp is.

    Parameters
    ----------
    rates : sequence of int
        Rates of the steps from standstill, in steps in `modulus` clocks.
    modulus : int
        See above.
    unit : int
        The rate of a speed of 1.
    settle : int
        Clocks that the motor has power before its first step.
    """

    def __init__(self, rates: Sequence[int], modulus: int, unit: int, settle: int) -> None:
        self._bounds = (0, rates[0], *rates)
        self.modulus, self.unit, self.settle = modulus, unit, settle

    def rate(self, level: int, mode: Mode) -> int:
        """Return the rate at which it goes."""
        low, high = self._bounds[level:level + 2]
        return min(max(mode.rate * self.unit, low), high)

    def after(self, level: int, left: int, mode: Mode) -> int:
        """Return the level after a step, with so many left to where it goes."""
        low, high = self._bounds[level:level + 2]
        asked, top = mode.rate * self.unit, len(self._bounds) - 2
        if level and (asked <= low or left < level):
            return level - 1
        return level + (asked > high and left > level and level < top)


class _State(NamedTuple):
    """What may be at a level.

    The sum of the rates since the last step is from `low` to `high`; where a step that is due waits
    it is what the step takes.
    The step is made in clock `due` at the latest.
    """

    low: int
    high: int
    due: int = NEVER

    def joined(self, other: "_State | None") -> "_State":
        """Return what is one or the other."""
        return self if other is None else _State(
            min(self.low, other.low), max(self.high, other.high), max(self.due, other.due))


def check_ramp(steps: Steps, effects: Sequence[Effect], ramp: Ramp, clocks: int) -> TrajectoryCheck:
    """Look at all steps of a motor with a ramp; `clocks` are those for which it was looked at."""
    motor, timed, deviation = _Motor(effects, ramp), 0, 0.0
    places = steps.place.tolist()
    for clock, direction, place in zip(steps.clock.tolist(), steps.direction.tolist(), places,
                                       strict=False):
        failure = motor.until(clock - 1, place)  # the coils change a clock later
        late = None if failure else motor.lateness()
        if late is not None:
            timed, deviation = timed + 1, max(deviation, late)
        if failure := failure or motor.step(direction, place):
            return TrajectoryCheck([failure], timed, deviation)
    failure = motor.until(clocks - 1, places[-1])
    return TrajectoryCheck([failure] if failure else [], timed, deviation)


class _Motor:
    def __init__(self, effects: Sequence[Effect], ramp: Ramp) -> None:
        self._ramp = ramp
        bounds, self._spans = intervals(effects, NEVER)
        self._begins = bounds.tolist()
        self._span, self._clock, self._direction = 0, 0, 0
        self._ready = 0  # from then on it has had power for long enough
        self._states = {0: _State(ramp.modulus, ramp.modulus)}  # at power-up a step is due

    @property
    def _modes(self) -> list[Mode]:
        """What it may be asked to do in this clock."""
        while self._begins[self._span + 1] <= self._clock:
            self._span += 1
        return self._spans[self._span]

    def until(self, clock: int, place: int) -> Failure | None:
        """Go on to a clock without a step."""
        while self._clock < clock and self._states:
            modes = self._modes
            end = min(self._begins[self._span + 1], clock)
            if not all(mode.run for mode in modes):
                self._ready = end + self._ramp.settle
            found: dict[int, _State] = {}
            for level, state in self._states.items():
                for to, own in self._goes_to(level, modes):
                    rates = [self._ramp.rate(at, mode) for mode in own for at in {level, to}]
                    asked = all(mode.run and (to or mode.low != place) for mode in own)
                    after = self._passed(state, rates, asked, end)
                    if after.due >= end:
                        found[to] = after.joined(found.get(to))
            self._states, self._clock = found, end
        if self._states:
            return None
        return Failure(self._clock, "step", f"no step from {place}, where one is due")

    @staticmethod
    def _goes_to(level: int, modes: Sequence[Mode]) -> Iterator[tuple[int, list[Mode]]]:
        """Yield the levels to which it may go without a step, and what it does meanwhile."""
        on = [mode for mode in modes if mode.run]
        if on and level:
            yield level, on
        if not level or len(on) < len(modes):
            yield 0, list(modes)

    def _passed(self, state: _State, rates: Sequence[int], asked: bool,
                end: int) -> _State:
        """Let clocks pass at one of some rates, in which a step is requested, or may be."""
        modulus, clocks = self._ramp.modulus, end - self._clock
        slow, fast = min(rates), max(rates)
        low, high = state.low, state.high
        needed = -(-(modulus - low) // slow)  # clocks until it is due for sure
        if needed <= 0 or slow == fast and needed == -(-(modulus - high) // fast) < clocks:
            low = high = modulus  # a step that waits begins the times anew
        elif slow == fast and needed == -(-(modulus - high) // fast):
            low, high = (each + clocks * slow for each in (low, high))
        else:
            low = min(low + clocks * slow, modulus)
            high = max(high, min(high + clocks * fast, modulus + fast - 1))
        if not asked:
            return _State(low, high)
        due = state.due
        if due == NEVER and needed <= clocks:
            due = max(self._clock + max(0, needed), self._ready)
        return _State(low, high, due)

    def lateness(self) -> float | None:
        """Return the most clocks that a step made now is late; None if there may be none."""
        (level, state), *others = self._states.items()
        late = state.high - self._ramp.modulus
        rate = self._ramp.rate(level, self._spans[self._span][0])  # in the clock before
        return None if others or not 0 <= late < rate else late / rate

    def step(self, direction: int, place: int) -> Failure | None:
        """Make a step from a place."""
        ramp, modes, found = self._ramp, self._modes, {}
        states = {level: state for level, state in self._states.items()
                  if state.high >= ramp.modulus}
        for level, state in states.items():
            for mode in modes:
                away = (mode.low - place) * direction
                if not mode.run or (direction != self._direction if level else away <= 0):
                    continue
                rate = ramp.rate(level, mode) - ramp.modulus
                after = _State(max(state.low, ramp.modulus) + rate, state.high + rate)
                to = ramp.after(level, away - 1, mode)
                found[to] = after.joined(found.get(to))
        shown = f"a step {'up' if direction > 0 else 'down'} from {place} that "
        if not states:
            return Failure(self._clock, "time", shown + "comes too early")
        if not found:
            return Failure(self._clock, "step", shown + "no command requested")
        self._states, self._direction, self._clock = found, direction, self._clock + 1
        return None
