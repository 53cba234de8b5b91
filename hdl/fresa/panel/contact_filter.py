"""Inputs that count once they have been steady for a time that can be set."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["ContactFilter"]


class ContactFilter(wiring.Component):
    """Passes a high level once it has been steady, for a time that is an input.

    As with :class:`GlitchFilter`, whose time is a constant, the output rises ``period`` clocks
    after its input, if that was high in all of them, and falls with the next clock in which the
    input is low. A change of ``period`` is for levels that rise after it.

    No register is reset: a contact that is held through a reset goes on to be passed.

    Parameters
    ----------
    most : int
        Longest time, in clocks.

    Members
    -------
    i : In(1)
        Input, synchronous to the clock.
    period : In(range(most + 1))
        Clocks for which the input must be high; 0 is as 1.
    o : Out(1)
        Filtered level. 0 at power-up.

    Raises
    ------
    ValueError
        If ``most`` is out of range.
    """

    def __init__(self, *, most: int) -> None:
        self.most = in_range("longest time of a contact filter", most, 1, 1 << 32)
        super().__init__({"i": In(1), "period": In(range(most + 1)), "o": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        count = Signal.like(self.period, reset_less=True)  # clocks in which it was high before
        level = Signal(reset_less=True)
        m.d.comb += self.o.eq(level)
        with m.If(~self.i):
            m.d.sync += [count.eq(0), level.eq(0)]
        with m.Elif(count + 1 >= self.period):
            m.d.sync += level.eq(1)
        with m.Else():
            m.d.sync += count.eq(count + 1)
        return m
