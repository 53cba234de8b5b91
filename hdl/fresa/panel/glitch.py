"""A level from a contact that acts soon, and not for a glitch."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import MAX_PERIOD, FrequencyDivider

__all__ = ["GlitchFilter"]


class GlitchFilter(wiring.Component):
    """Passes a high level once it has been steady.

    The output rises ``period`` clocks after its input, if that was high in all of them, and falls
    with the next clock in which the input is low. So a glitch shorter than ``period`` never passes,
    and a contact that bounces passes as soon as it has been closed that long. The output may
    bounce when the contact opens: it is for an input that is latched.

    No register is reset: a contact that is held through a reset goes on to be passed.

    Parameters
    ----------
    period : int
        Time for which the input must be high, in clocks.

    Members
    -------
    i : In(1)
        Input, synchronous to the clock.
    o : Out(1)
        Filtered level. 0 at power-up.

    Raises
    ------
    ValueError
        If ``period`` is out of range.
    """

    i: In(1)
    o: Out(1)

    def __init__(self, *, period: int) -> None:
        self.period = in_range("filter period", period, 1, MAX_PERIOD)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.divider = divider = FrequencyDivider(period=self.period, reset_less=True)
        m.d.comb += [divider.enable.eq(self.i), divider.clear.eq(~self.i)]

        level = Signal(reset_less=True)
        m.d.comb += self.o.eq(level)
        with m.If(~self.i):
            m.d.sync += level.eq(0)
        with m.Elif(divider.tick):
            m.d.sync += level.eq(1)

        return m
