"""The coils of one unipolar stepper."""

from amaranth import Cat, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .divider import valid_period
from .sequences import FULL_STEP

__all__ = ["CoilDriver"]


# One table alone: full step is the only one of which two flip-flops are all the coils there are.
# For others there is PhaseDriver.
class CoilDriver(wiring.Component):
    """Phase sequence of one motor: full step, two phases on.

    *Driver de motor* (thesis, 4.1.5). In every row of table 1, BROWN is the opposite of BLACK and
    YELLOW the opposite of ORANGE. So two flip-flops hold the phase, every coil comes straight from
    one of them, all four codes are states, and a word that is not in the table cannot be expressed.

    A step is made, and the coils change with the next clock edge, when it is requested and the last
    one was at least ``period`` clocks ago. An earlier request is ignored and reported. Reset
    makes no step and changes neither the phase nor the time since the last step: only power-up sets
    state 1.

    Parameters
    ----------
    period : int
        Least number of clocks between two steps, from 1 to ``MAX_PERIOD``.

    Members
    -------
    step : In(1)
        Make a step.
    direction : In(1)
        1 goes down table 1 (ascending), 0 goes back.
    moved : Out(1)
        The requested step is made in this clock: use it as count enable.
    refused : Out(1)
        The requested step is too early, or comes with reset, and is ignored.
    coils : Out(4)
        Coil word, BLACK in bit 3 to YELLOW in bit 0, 1 for +.

    Raises
    ------
    ValueError
        If ``period`` is out of range.
    """

    step: In(1)
    direction: In(1)
    moved: Out(1)
    refused: Out(1)
    coils: Out(4)

    def __init__(self, *, period: int) -> None:
        self.period = valid_period(period)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        rested = Signal()
        if self.period == 1:
            m.d.comb += rested.eq(1)
        else:
            # As in FrequencyDivider, but it stays where the time is over.
            rest = Signal(range(1 - self.period, 1), init=0, reset_less=True)
            m.d.comb += rested.eq(rest[-1] == 0)
            with m.If(self.moved):
                m.d.sync += rest.eq(1 - self.period)
            with m.Elif(~rested):
                m.d.sync += rest.eq(rest + 1)

        m.d.comb += [
            self.moved.eq(self.step & rested & ~ResetSignal()),
            self.refused.eq(self.step & ~self.moved),
        ]

        black = Signal(init=FULL_STEP[0] >> 3 & 1, reset_less=True)
        orange = Signal(init=FULL_STEP[0] >> 2 & 1, reset_less=True)
        m.d.comb += self.coils.eq(Cat(~orange, ~black, orange, black))
        with m.If(self.moved):
            m.d.sync += [
                black.eq(orange ^ self.direction),
                orange.eq(black ^ ~self.direction),
            ]

        return m
