"""Inputs that count once they have been steady for a time that can be set."""

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["ContactFilter"]


class ContactFilter(wiring.Component):
    """Passes high levels once they have been steady, for a time that is an input.

    An output rises when its input has been high for at least ``period`` clocks and at most one and
    a half times as many, plus 6; it falls with the next clock in which the input is low. One
    counter serves all: a level passes that was high in three of its ticks, half a period apart. A
    change of ``period`` is for levels that rise after it; one that is rising passes when it has
    been high for three times ``most`` clocks, at the latest.

    No register is reset: a contact that is held through a reset goes on to be passed.

    Parameters
    ----------
    width : int
        Inputs.
    most : int
        Longest time, in clocks.

    Members
    -------
    i : In(width)
        Inputs, synchronous to the clock.
    period : In(range(most + 1))
        Clocks for which an input must be high.
    o : Out(width)
        Filtered levels. 0 at power-up.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int, most: int) -> None:
        self.width = in_range("width of a contact filter", width, 1, 64)
        self.most = in_range("longest time of a contact filter", most, 1, 1 << 32)
        super().__init__({"i": In(width), "period": In(range(most + 1)), "o": Out(width)})

    def elaborate(self, platform) -> Module:
        m = Module()
        half = self.period[1:]
        # One more bit, for the clock of the tick.
        count = Signal(len(half) + 1, reset_less=True)
        tick = Signal(reset_less=True)
        m.d.sync += [tick.eq(count == half), count.eq(Mux(tick, 0, count + 1))]
        for number, (level, passed) in enumerate(zip(self.i, self.o, strict=True)):
            ticks = Signal(3, name=f"ticks_{number}", reset_less=True)  # in which it was high
            m.d.comb += passed.eq(ticks[-1])
            with m.If(~level):
                m.d.sync += ticks.eq(0)
            with m.Elif(tick):
                m.d.sync += ticks.eq(ticks << 1 | 1)
        return m
