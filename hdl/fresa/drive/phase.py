"""The coils of one stepper, by any table of coil words."""

from collections.abc import Sequence

from amaranth import Array, Module, Mux, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .divider import valid_period
from .sequences import valid_sequence

__all__ = ["PhaseDriver"]


class PhaseDriver(wiring.Component):
    """Goes through a table of coil words, a row a step, and can leave a motor without power.

    :class:`CoilDriver` needs fewer flip-flops, but has one fixed table. Here three hold the row and
    four the coils. The coils are looked up anew in every clock, so that a coil that is upset is
    right again with the next; all codes of the row are rows.

    A step is made, and the coils change with the next clock edge, when it is requested and the
    present coil word has lasted ``period`` clocks. So after ``enable`` rises the motor
    has that long to settle. Without ``enable`` all coils are off from the next clock on;
    the row stays. Reset makes no step and changes nothing else: only power-up sets the first row.

    Parameters
    ----------
    sequence : sequence of int
        4 or 8 coil words, such as ``HALF_STEP`` or ``swap_inner(FULL_STEP)``.
    period : int
        Least number of clocks that a coil word lasts, from 1 to ``MAX_PERIOD``.

    Members
    -------
    step : In(1)
        Make a step.
    direction : In(1)
        1 goes down the table, 0 goes back.
    enable : In(1)
        Give the motor power.
    ready : Out(1)
        A step requested in this clock is made.
    moved : Out(1)
        The requested step is made in this clock: use it as count enable.
    coils : Out(4)
        Coil word, or 0.

    Raises
    ------
    ValueError
        If ``sequence`` is none, or ``period`` is out of range.
    """

    step: In(1)
    direction: In(1)
    enable: In(1)
    ready: Out(1)
    moved: Out(1)
    coils: Out(4)

    def __init__(self, *, sequence: Sequence[int], period: int) -> None:
        self.sequence = valid_sequence(sequence)
        self.period = valid_period(period)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        # As in FrequencyDivider, but it stays where the time is over. It is one clock longer where
        # the coils are off, since they come on with the next clock only.
        rest = Signal(range(-self.period, 1), init=-self.period, reset_less=True)
        with m.If(~self.enable):
            m.d.sync += rest.eq(-self.period)
        with m.Elif(self.moved):
            m.d.sync += rest.eq(1 - self.period)
        with m.Elif(rest[-1]):
            m.d.sync += rest.eq(rest + 1)

        m.d.comb += [
            self.ready.eq(self.enable & (rest[-1] == 0) & ~ResetSignal()),
            self.moved.eq(self.step & self.ready),
        ]

        row = Signal(range(len(self.sequence)), reset_less=True)
        other = Signal.like(row)
        coils = Signal(4, reset_less=True)
        m.d.comb += [
            other.eq(row + Mux(self.direction, 1, -1)),
            self.coils.eq(coils),
        ]
        with m.If(self.moved):
            m.d.sync += row.eq(other)
        # Both are looked up, since it is known last whether a step is made.
        words = Array(self.sequence)
        m.d.sync += coils.eq(Mux(self.enable, Mux(self.moved, words[other], words[row]), 0))

        return m
