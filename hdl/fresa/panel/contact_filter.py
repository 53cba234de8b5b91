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
    input is low. A change of ``period`` is for levels that rise after it; one that is rising
    passes when it has been high for twice ``most`` clocks, at the latest.

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
        # Clocks in which it was high before, and two more: so it is known a clock ahead, by a
        # register, that there are enough of them. The highest bit is for a period that has become
        # less than these.
        count = Signal(len(self.period) + 1, init=2, reset_less=True)
        enough = Signal(reset_less=True)
        level = Signal(reset_less=True)
        m.d.comb += self.o.eq(level)
        with m.If(~self.i):
            m.d.sync += [count.eq(2), enough.eq(0), level.eq(0)]
        with m.Else():
            with m.If((count == self.period) | count[-1]):
                m.d.sync += enough.eq(1)
            with m.If(~enough):
                m.d.sync += count.eq(count + 1)
            with m.If(enough | (self.period <= 1)):
                m.d.sync += level.eq(1)
        return m
