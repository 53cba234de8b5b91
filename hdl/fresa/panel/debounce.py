"""Clean levels from contacts that bounce."""

from fractions import Fraction
from math import ceil

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import MAX_PERIOD, FrequencyDivider

__all__ = ["DEBOUNCE", "Debouncer", "debounce_period"]

DEBOUNCE = Fraction(1, 100)
"""Time for which a contact must be still, in seconds."""


def debounce_period(clock: int, seconds: Fraction | float = DEBOUNCE) -> int:
    """Clocks in `seconds` at a clock in Hz, one more rather than one less.

    Raises
    ------
    ValueError
        If it takes no clock, or more than a debouncer counts.
    """
    if not 0 < seconds * clock <= MAX_PERIOD:
        raise ValueError(f"debounce time must be over 0 and at most {MAX_PERIOD / clock:g} s, "
                         f"not {seconds!r}")
    return ceil(Fraction(seconds) * clock)


class Debouncer(wiring.Component):
    """Follows inputs that have settled.

    One divider serves all inputs. An output changes at a tick if its input has differed from it in
    every clock since the tick before. So a glitch shorter than ``period`` never passes, and a level
    that lasts two periods always does.

    No register is reset, since reset itself comes from a button: its release must be seen.

    Parameters
    ----------
    width : int
        Number of inputs.
    period : int
        Time for which an input must be stable, in clocks.

    Members
    -------
    i : In(width)
        Inputs, synchronous to the clock.
    o : Out(width)
        Clean levels. 0 at power-up.

    Raises
    ------
    ValueError
        If ``width`` or ``period`` is out of range.
    """

    def __init__(self, *, width: int, period: int) -> None:
        self.width = in_range("width", width, 1, 1024)
        self.period = in_range("debounce period", period, 1, MAX_PERIOD)
        super().__init__({"i": In(width), "o": Out(width)})

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.divider = divider = FrequencyDivider(period=self.period, reset_less=True)
        m.d.comb += divider.enable.eq(1)

        level = Signal(self.width, reset_less=True)
        differs = Signal(self.width, reset_less=True)  # in every clock since the last tick
        still = self.i ^ level
        m.d.comb += self.o.eq(level)
        with m.If(divider.tick):
            m.d.sync += [
                level.eq(level ^ (still & differs)),
                differs.eq(~0),
            ]
        with m.Else():
            m.d.sync += differs.eq(differs & still)

        return m
