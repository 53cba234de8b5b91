"""Two driver modules whose motors move one axis."""

from amaranth import Cat, Module, ResetSignal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .step_dir import MAX_PULSE, StepDirDriver

__all__ = ["StepDirPair"]


class StepDirPair(wiring.Component):
    """Makes each step at the pins of two driver modules in the same clock, or at neither.

    It is used as a :class:`StepDirDriver`, with the same times at both, and while no motor is
    halted it behaves like one in every clock. A motor that is halted makes no step, and its DIR
    stays; the other one makes them alone. Where both are, no step is made.

    The trick is to offer a step to a driver that is ready only together with the other one: a
    driver that is not ready is offered it always, as that turns its DIR. So what one of them still
    has to wait for keeps back both, also behind a halt, after which their times differ.

    Parameters
    ----------
    width, low, setup, hold : int
        Times in clocks, see :class:`StepDirDriver`.
    adjustable : bool
        The time of a pulse is an input.

    Members
    -------
    step, direction, enable : In(1)
        As of :class:`StepDirDriver`, for both motors.
    width_now : In(range(width + 1))
        As of :class:`StepDirDriver`, for both motors. Only if `adjustable`.
    halt : In(2)
        Motors that make no steps. A pulse that has begun ends.
    moved : Out(1)
        The requested step is made in this clock, by each motor that is not halted: use it as count
        enable.
    step_pin, direction_pin, enable_pin : Out(1)
        STEP and DIR of the first motor, and ENABLE of both, from flip-flops.
    second_step_pin, second_direction_pin : Out(1)
        STEP and DIR of the second motor.

    Raises
    ------
    ValueError
        If a time is out of range.
    """

    def __init__(self, *, width: int, low: int, setup: int, hold: int,
                 adjustable: bool = False) -> None:
        times = {"width": width, "low": low, "setup": setup, "hold": hold}
        self._times = {name: in_range(name, time, 1, MAX_PULSE) for name, time in times.items()}
        self.width, self.adjustable = width, adjustable
        super().__init__({
            "step": In(1), "direction": In(1), "enable": In(1), "halt": In(2), "moved": Out(1),
            "step_pin": Out(1), "direction_pin": Out(1), "enable_pin": Out(1),
            "second_step_pin": Out(1), "second_direction_pin": Out(1),
            **({"width_now": In(range(width + 1))} if adjustable else {})})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.first = first = StepDirDriver(
            **self._times, adjustable=self.adjustable)
        m.submodules.second = second = StepDirDriver(
            **self._times, adjustable=self.adjustable)
        drivers = tuple(zip((first, second), self.halt, strict=True))
        all_ready = Cat(driver.ready | halt for driver, halt in drivers).all()
        for driver, halt in drivers:
            m.d.comb += [
                driver.step.eq(self.step & ~halt & (all_ready | ~driver.ready)),
                driver.direction.eq(self.direction), driver.enable.eq(self.enable),
            ]
            if self.adjustable:
                m.d.comb += driver.width_now.eq(self.width_now)
        m.d.comb += [
            self.moved.eq(self.step & all_ready & ~self.halt.all() & ~ResetSignal()),
            self.step_pin.eq(first.step_pin), self.direction_pin.eq(first.direction_pin),
            self.second_step_pin.eq(second.step_pin),
            self.second_direction_pin.eq(second.direction_pin),
            self.enable_pin.eq(first.enable_pin & second.enable_pin),
        ]
        return m
