"""Clock enables at a fixed rate."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_PERIOD", "FrequencyDivider", "valid_period"]

MAX_PERIOD = 2**26
"""Longest period of a divider and of a coil driver, in clocks: 1.3 s at 50 MHz."""


def valid_period(value: object, *, name: str = "period") -> int:
    """Return `value` if it is a number of clocks that a step may take, else raise ValueError."""
    return in_range(name, value, 1, MAX_PERIOD)


class FrequencyDivider(wiring.Component):
    """Counts clocks while it is enabled and gives a tick at every ``period``-th.

    *Divisor de Frecuencia* (thesis, 4.1.3 and 4.1.5). ``tick`` follows ``enable`` in the same
    clock; with ``period`` 1 it is ``enable``. While ``enable`` is low the count waits where it is.

    Parameters
    ----------
    period : int
        Clocks from one tick to the next, from 1 to ``MAX_PERIOD``.
    reset_less : bool
        Go on counting through reset.

    Members
    -------
    enable : In(1)
        Count this clock.
    clear : In(1)
        Begin the count anew with the next clock.
    tick : Out(1)
        This is the ``period``-th enabled clock since the last tick, the last clear or reset.

    Raises
    ------
    ValueError
        If ``period`` is out of range.
    """

    enable: In(1)
    clear: In(1)
    tick: Out(1)

    def __init__(self, *, period: int, reset_less: bool = False) -> None:
        self.period = valid_period(period)
        self.reset_less = reset_less
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        if self.period == 1:
            m.d.comb += self.tick.eq(self.enable)
            return m

        # Counts 1 - period ... -1, 0: the sign bit marks the end, so no comparator is needed.
        count = Signal(range(1 - self.period, 1), init=1 - self.period, reset_less=self.reset_less)
        m.d.comb += self.tick.eq(self.enable & (count[-1] == 0))
        with m.If(self.enable):
            m.d.sync += count.eq(count + 1)
        with m.If(self.tick | self.clear):
            m.d.sync += count.eq(count.init)

        return m
