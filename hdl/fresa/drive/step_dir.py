"""The STEP, DIR and ENABLE pins of a driver module."""

from amaranth import Cat, Module, Mux, ResetSignal, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_PULSE", "StepDirDriver"]

MAX_PULSE = 2**16
"""Longest of the times of a driver module, in clocks: 1.3 ms at 50 MHz."""


class StepDirDriver(wiring.Component):
    """Makes one STEP pulse a step and keeps the times of the driver module, whatever its inputs do.

    Nothing is queued. A requested step is made, and STEP rises with the next clock edge, when
    ``ready``; until then it waits, and it is dropped if ``step`` falls or ``direction`` changes.
    So ``moved`` counts exactly what leaves the pin, and a step can still be blocked in the last
    clock before the pin. A pulse that has begun lasts its time: no input and no reset cuts it.

    A step in the other direction turns DIR first. DIR and ENABLE change only while STEP is low,
    ``hold`` clocks or more after it fell, and then are left alone for ``setup`` clocks or more
    before it rises. So ENABLE follows ``enable`` within ``width`` and the longer of ``low`` and
    ``hold``, or within ``setup`` if that is longer, and a step that stays requested is made
    ``setup`` after that at the latest.

    One timer serves all of that: each change of a pin starts it, and nothing else happens until it
    ends. Every code of the registers is a state that leads on by itself. The registers are not
    reset, since a driver module has no reset either; during a reset no pulse begins.

    Parameters
    ----------
    width : int
        Clocks of a pulse, or of the longest one.
    low : int
        Least number of clocks from pulse to pulse.
    setup : int
        Least number of clocks that DIR and ENABLE are stable before a pulse.
    hold : int
        Least number of clocks that they are stable after a pulse.
    adjustable : bool
        The time of a pulse is an input.

    Members
    -------
    step : In(1)
        Make a step.
    direction : In(1)
        What DIR shall be for it.
    enable : In(1)
        Give the motor power.
    width_now : In(range(width + 1))
        Clocks of a pulse that begins, from 1: sampled with its step. Only if `adjustable`.
    ready : Out(1)
        A step requested in this clock is made: DIR and ENABLE are set, and all times have passed.
    moved : Out(1)
        The requested step is made in this clock: use it as count enable.
    step_pin, direction_pin, enable_pin : Out(1)
        STEP, DIR and ENABLE, high when on, from flip-flops.

    Raises
    ------
    ValueError
        If a time is not from 1 to ``MAX_PULSE``.
    """

    def __init__(self, *, width: int, low: int, setup: int, hold: int,
                 adjustable: bool = False) -> None:
        self.width = in_range("width", width, 1, MAX_PULSE)
        self.low = in_range("low", low, 1, MAX_PULSE)
        self.setup = in_range("setup", setup, 1, MAX_PULSE)
        self.hold = in_range("hold", hold, 1, MAX_PULSE)
        self.adjustable = adjustable
        super().__init__({
            "step": In(1), "direction": In(1), "enable": In(1), "ready": Out(1), "moved": Out(1),
            "step_pin": Out(1), "direction_pin": Out(1), "enable_pin": Out(1),
            **({"width_now": In(range(width + 1))} if adjustable else {})})

    def elaborate(self, platform) -> Module:
        m = Module()

        high = Signal(reset_less=True)
        sense = Signal(reset_less=True)
        power = Signal(reset_less=True)
        m.d.comb += [
            self.step_pin.eq(high),
            self.direction_pin.eq(sense),
            self.enable_pin.eq(power),
        ]

        # The sign bit of the timer means that it runs. While it does not, it is loaded in every
        # clock with the time that a change would take; then a change, which is known last, has to
        # set that bit alone. It runs at power-up: the pins before that are unknown.
        pause = max(self.low, self.hold)
        longest = max(self.width, pause, self.setup)
        wait = Signal(signed(1 + max(0, longest - 2).bit_length()), init=1 - longest,
                      reset_less=True)
        over = Signal()
        idle = Signal()
        differs = Signal()
        turns = Signal()
        m.d.comb += [
            over.eq(wait[-1] == 0),
            idle.eq(over & ~high),
            self.ready.eq(idle & power & self.enable & ~ResetSignal() & (sense == self.direction)),
            self.moved.eq(self.step & self.ready),
            differs.eq((power != self.enable) | (sense != self.direction)),
            turns.eq(~high & ((power != self.enable) | (self.step & differs))),
        ]
        # A time of one clock is over with the change.
        width, lasts = 1 - self.width, self.moved
        if self.adjustable:
            width, lasts = 1 - self.width_now, self.moved & (self.width_now != 1)
        starts = [change for change, time in [
            (high, pause), (lasts, self.width), (turns, self.setup)] if time > 1]
        with m.If(over):
            m.d.sync += [
                high.eq(self.moved),
                wait.eq(Cat(Mux(high, 1 - pause, Mux(differs, 1 - self.setup, width))
                            .as_unsigned()[:len(wait) - 1], Cat(starts).any())),
            ]
        with m.Else():
            m.d.sync += wait.eq(wait + 1)
        with m.If(idle):
            m.d.sync += power.eq(self.enable)
            # DIR changes only for a step: `direction` alone moves no pin.
            with m.If(self.step):
                m.d.sync += sense.eq(self.direction)

        return m
