"""Jogging by hand."""

from amaranth import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..drive import FrequencyDivider, valid_period

__all__ = ["ManualControl"]


class ManualControl(wiring.Component):
    """Two switches an axis make it step for as long as they are on.

    *Control Manual* (thesis, 4.2.2). Both switches of an axis on means up. A switch that is already
    on when manual mode is entered, or at reset, does nothing until it has been off once.

    With ``period`` 1 a step is requested in every clock, and the least period of the coil drivers
    sets the speed: the motor's highest.

    Parameters
    ----------
    period : int
        Clocks from one step request to the next. The drivers refuse requests that are too early for
        them: give 1, or no less than their period.

    Members
    -------
    enable : In(1)
        Manual mode.
    jog : In(6)
        Switches: x up, x down, y up, y down, z up, z down from bit 0. Synchronous and clean.
    step, direction : Out(3)
        Step requests, from the same clock as the switch; ``direction`` 1 is up.
    active : Out(3)
        Axes that are being jogged.
    """

    enable: In(1)
    jog: In(6)
    step: Out(3)
    direction: Out(3)
    active: Out(3)

    def __init__(self, *, period: int = 1) -> None:
        self.period = valid_period(period, name="jog_period")
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        seen_off = Signal(6)
        with m.If(self.enable):
            m.d.sync += seen_off.eq(seen_off | ~self.jog)
        with m.Else():
            m.d.sync += seen_off.eq(0)

        up = Signal(3)
        down = Signal(3)
        pressed = self.jog & seen_off & self.enable.replicate(6)
        m.d.comb += [up.eq(Cat(pressed[0::2])), down.eq(Cat(pressed[1::2]))]

        m.submodules.divider = divider = FrequencyDivider(period=self.period)
        m.d.comb += [
            self.direction.eq(up),
            self.active.eq(up | down),
            divider.enable.eq(self.active.any()),
            divider.clear.eq(~self.active.any()),
            self.step.eq(self.active & divider.tick.replicate(3)),
        ]

        return m
