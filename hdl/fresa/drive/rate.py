"""Steps at a set rate, without drift."""

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_MODULUS", "RateGenerator"]

MAX_MODULUS = 2**40
"""Most clocks in which there are `rate` steps: six hours at 50 MHz."""


class RateGenerator(wiring.Component):
    """Phase accumulator: `rate` steps come due in `modulus` clocks, without drift.

    The accumulator grows by the rate in every clock; when it reaches the modulus a step is due, and
    the step subtracts the modulus. Nothing is rounded, so no error accumulates: at a constant rate
    the n-th step is due in clock ``ceil(n * modulus / rate)``, never before its exact time and less
    than a clock after it, for every n. A new rate counts from the clock in which it is given, also
    for the step under way.

    A step that is due waits until it is made, and times count anew from the clock in which it is:
    what the accumulator has beyond the modulus is cleared, since at another rate it would be
    another time. So none is lost while a motor is not ready or at rest, and after a wait the steps
    do not catch up: no two steps are ever closer than ``modulus // max_rate`` clocks. Reset changes
    nothing. At power-up a step is due, as at rest.

    With steps/s as unit of the rate, ``modulus`` is the frequency of the clock. With turns a minute
    and a motor of 48 steps a turn, it is 60/48 of that.

    Parameters
    ----------
    modulus : int
        Clocks in which there are `rate` steps, from 1 to ``MAX_MODULUS``.
    max_rate : int
        Highest rate, from 1 to ``modulus``. A higher one is clamped to it, which takes no logic if
        it is all that the bits of `rate` can express.

    Members
    -------
    rate : In(range(max_rate + 1))
        Steps in ``modulus`` clocks. With 0 no step comes due.
    moved : In(1)
        The step that is due is made in this clock. Ignored while none is due.
    due : Out(1)
        A step is due.

    Raises
    ------
    ValueError
        If ``modulus`` or ``max_rate`` is out of range.
    """

    def __init__(self, *, modulus: int, max_rate: int) -> None:
        self.modulus = in_range("modulus", modulus, 1, MAX_MODULUS)
        self.max_rate = in_range("max_rate", max_rate, 1, self.modulus)
        super().__init__({"rate": In(range(self.max_rate + 1)), "moved": In(1), "due": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()

        rate = Signal.like(self.rate)
        m.d.comb += rate.eq(Mux(self.rate > self.max_rate, self.max_rate, self.rate))

        # Accumulator less modulus: its sign bit is the comparison. It starts at 0 as a flip-flop of
        # an iCE40 does: another initial bit would take an inverter in front of the adder.
        accumulator = Signal(range(-self.modulus, self.max_rate), reset_less=True)
        m.d.comb += self.due.eq(accumulator[-1] == 0)
        with m.If(self.due & ~self.moved):
            m.d.sync += accumulator.eq(0)
        with m.Else():
            m.d.sync += accumulator.eq(accumulator + Mux(self.due, rate - self.modulus, rate))

        return m
