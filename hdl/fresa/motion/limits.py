"""Switches at the ends of axes."""

from amaranth import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import MAX_PERIOD, FrequencyDivider

__all__ = ["Limits"]


class Limits(wiring.Component):
    """Tells which limit switches are on, though contacts bounce, as they close and as they open.

    A switch counts as on from the clock in which it is seen, for ``period`` clocks after it was
    last seen on, and for at most twice as long. So steps towards it can be blocked at once, and a
    glitch only delays them. One divider serves all switches.

    Reset changes nothing.

    Parameters
    ----------
    axes : int
        Number of axes, from 1 to 64.
    period : int
        Time in which a contact settles, in clocks, from 1 to ``MAX_PERIOD``.

    Members
    -------
    low, high : In(axes)
        The switch at that end is pressed, a bit an axis. Synchronous to the clock.
    at_low, at_high : Out(axes)
        The switch at that end counts as on.

    Raises
    ------
    ValueError
        If ``axes`` or ``period`` is out of range.
    """

    def __init__(self, *, axes: int, period: int) -> None:
        self.axes = in_range("axes", axes, 1, 64)
        self.period = in_range("limits period", period, 1, MAX_PERIOD)
        super().__init__(
            {"low": In(axes), "high": In(axes), "at_low": Out(axes), "at_high": Out(axes)})

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.divider = divider = FrequencyDivider(period=self.period, reset_less=True)
        m.d.comb += divider.enable.eq(1)

        on = Cat(self.low, self.high)
        since = Signal.like(on, reset_less=True)  # on since the last tick
        before = Signal.like(on, reset_less=True)  # on between the two ticks before
        with m.If(divider.tick):
            m.d.sync += [before.eq(since | on), since.eq(0)]
        with m.Else():
            m.d.sync += since.eq(since | on)

        m.d.comb += Cat(self.at_low, self.at_high).eq(on | since | before)

        return m
