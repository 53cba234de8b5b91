"""`mill`, clock by clock, in plain Python.

It says what the pins do and nothing of how the gateware does it: positions are whole numbers, times
are clock numbers, movements are lists of what is still to do.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import ClassVar

from ...models.panel import LIT

__all__ = ["COILS", "MillInputs", "MillModel", "MillOutputs"]

COILS = (0b0110, 0b0011, 0b1001, 0b1100)


@dataclass
class MillInputs:
    """Levels of the input pins in one clock."""

    rst: int = 0
    mode: int = 0
    position_x: int = 0
    position_y: int = 0
    up: int = 0
    down: int = 0
    start: int = 0
    counter_select: int = 0
    jog: int = 0
    stop: int = 0


@dataclass
class MillOutputs:
    """Levels of the output pins in one clock."""

    ready: int
    error: int
    axis_x: int
    axis_y: int
    axis_z: int
    leds: int
    count: int
    segments: int
    digits: int


@dataclass
class _Movement:
    """A simple movement: signed directions of the axes in it, steps to make, clock of the next."""

    direction: dict[int, int]
    steps: int
    due: int


@dataclass
class _Automatic:
    """All that a change to manual mode forgets."""

    at: list[int] = field(default_factory=lambda: [0, 0, 0])
    made: int = 0  # steps of the last simple movement
    error: bool = False
    busy: bool = False
    plan: deque = field(default_factory=deque)  # (clock from which it may run, what)
    movement: _Movement | None = None
    rests_at: int = 0  # clock from which a simple movement can be taken
    decide: tuple[int, int] | None = None


class MillModel:
    """The pins of `mill`.

    Call :meth:`outputs` and then :meth:`edge` with the inputs of a clock, for each clock.

    Parameters
    ----------
    period : int
        Least clocks between two steps.
    scan_bits : int
        A digit of the display has its turn for ``2 ** scan_bits`` clocks.
    z_travel : int
        Steps between the raised and the lowered tool.
    jog_period : int
        Clocks from one step request by hand to the next.
    """

    Inputs: ClassVar[type] = MillInputs

    def __init__(self, *, period: int, scan_bits: int, z_travel: int, jog_period: int = 1) -> None:
        self.period = period
        self.turn = 2**scan_bits
        self.z_travel = z_travel
        self.jog_period = jog_period
        self.clock = 0
        self.phase = [0, 0, 0]
        self.last_step: list[float] = [float("-inf")] * 3
        self.start_seen = False
        self._reset()

    def _reset(self) -> None:
        self.auto = _Automatic()
        self.stopped = False
        self.display_since = self.clock
        self.seen_off = 0
        self.jog_clocks = 0

    # What the pins show

    def outputs(self, pins: MillInputs) -> MillOutputs:
        """Return the outputs in this clock."""
        a = self.auto
        held = bool(pins.stop or self.stopped)
        coils = [COILS[phase] for phase in self.phase]
        counts = [a.made, *(at % 65536 for at in a.at)]
        count = counts[pins.counter_select]

        leds = 0
        if not pins.mode:
            moving = [axis for axis in range(3) if self._jogged(pins, axis) and not held]
            leds = coils[moving[0] if moving else 0]

        time = self.clock - self.display_since
        digit, when = time // self.turn % 4, time % self.turn
        lit = pins.mode and self.turn // 8 <= when < self.turn - self.turn // 8
        shape = sum(1 << "abcdefg".index(s) for s in LIT[count >> 4 * digit & 15])
        return MillOutputs(
            ready=int(bool(pins.mode) and not a.busy and not held),
            error=int(a.error),
            axis_x=coils[0], axis_y=coils[1], axis_z=coils[2],
            leds=leds, count=count,
            segments=0xFF ^ shape,
            digits=0xF ^ (1 << digit if lit else 0),
        )

    def _jogged(self, pins: MillInputs, axis: int) -> int:
        """Return +1, -1 or 0: where the switches that count send an axis."""
        if pins.mode:
            return 0
        switches = pins.jog & self.seen_off
        if switches >> 2 * axis & 1:
            return 1
        return -1 if switches >> 2 * axis + 1 & 1 else 0

    # What a clock edge does

    def edge(self, pins: MillInputs) -> None:
        """Go to the next clock."""
        held = bool(pins.stop or self.stopped)
        # A start counts, or comes too early, once; then it must fall.
        counts = self.auto.busy or not (held or pins.rst or not pins.mode)
        start_seen = bool(pins.start) and (self.start_seen or counts)
        self._edge(pins, held)
        self.start_seen = start_seen

    def _edge(self, pins: MillInputs, held: bool) -> None:
        if pins.rst:
            self.clock += 1
            self._reset()
            return

        if pins.mode:
            self._automatic(pins, held)
            self.seen_off, self.jog_clocks = 0, 0
        else:
            self._manual(pins, held)
            self.auto = _Automatic()
        self.stopped = held
        self.clock += 1

    def _step(self, axis: int, direction: int) -> bool:
        """Make a step, unless it is too soon."""
        if self.clock - self.last_step[axis] < self.period:
            return False
        self.last_step[axis] = self.clock
        self.phase[axis] = (self.phase[axis] + direction) % 4
        return True

    def _manual(self, pins: MillInputs, held: bool) -> None:
        jogged = [self._jogged(pins, axis) for axis in range(3)]
        self.jog_clocks = self.jog_clocks + 1 if any(jogged) else 0
        if self.jog_clocks == self.jog_period:
            self.jog_clocks = 0
            for axis in range(3):
                if jogged[axis] and not held:
                    self._step(axis, jogged[axis])
        self.seen_off |= ~pins.jog

    def _automatic(self, pins: MillInputs, held: bool) -> None:
        a = self.auto
        begins = bool(pins.start and not self.start_seen)
        tool = bool(pins.up or pins.down)

        if a.busy:
            self._carry_on(held)
            if begins and tool:
                a.error = True
        elif begins and not held:
            a.busy = True
            if pins.up and pins.down:
                a.error = True
                a.plan.append((self.clock + 1, "wait", None))
            elif tool:
                a.plan.append((self.clock + 1, "tool", 1 if pins.up else -1))
            else:
                a.plan.append((self.clock + 1, "decide", (pins.position_x, pins.position_y)))

    def _carry_on(self, held: bool) -> None:
        a = self.auto
        now = self.clock
        at_rest = a.movement is None and now >= a.rests_at
        self._move(held)
        if a.plan:
            when, what, detail = a.plan[0]
            if now < when:
                return
            if what == "wait":
                if at_rest:
                    a.plan.popleft()
            elif what == "move":
                if at_rest:
                    a.plan.popleft()
                    self._begin(*detail)
            else:
                a.plan.popleft()
                getattr(self, f"_{what}")(detail)
        if not a.plan:
            a.busy = False

    def _tool(self, direction: int) -> None:
        a = self.auto
        a.error = False
        there = (a.at[2] == 0) == (direction == 1)
        if not there:
            self._begin({2: direction}, self.z_travel)
        a.plan.append((self.clock + 1, "wait", None))

    def _decide(self, target: tuple[int, int]) -> None:
        a = self.auto
        a.error = False
        far = [target[axis] - a.at[axis] % 65536 for axis in range(2)]
        sign = {axis: 1 if far[axis] > 0 else -1 for axis in range(2)}
        steps = [abs(f) for f in far]
        if steps == [0, 0]:
            return
        if steps[0] == steps[1]:
            a.plan.append((self.clock + 1, "move", (sign, steps[0])))
            a.plan.append((self.clock + 2, "wait", None))
            return
        if a.at[2] != 0 and 0 not in steps:
            a.error = True
            return
        # A diagonal, if there is one, and its end; then the rest.
        long = 0 if steps[0] > steps[1] else 1
        if min(steps):
            a.plan.append((self.clock + 1, "move", (sign, min(steps))))
        a.plan.append((self.clock + 2, "wait", None))
        a.plan.append((self.clock + 3, "move", ({long: sign[long]}, abs(steps[0] - steps[1]))))
        a.plan.append((self.clock + 4, "wait", None))

    def _begin(self, direction: dict[int, int], steps: int) -> None:
        self.auto.movement = _Movement(direction, steps, self.clock + self.period)
        self.auto.made = 0

    def _move(self, held: bool) -> None:
        a = self.auto
        movement = a.movement
        if movement is None:
            return
        if a.made == movement.steps:
            # One clock to see the end, one to clear; then the next can be taken.
            a.movement = None
            a.rests_at = self.clock + 2
            return
        if self.clock < movement.due:
            return
        movement.due = self.clock + self.period
        stepped = False
        for axis, direction in movement.direction.items():
            if not held and self._step(axis, direction):
                a.at[axis] += direction
                stepped = True
        a.made += stepped
