"""Spindle and coolant around an open door: off, and on again one after the other."""

from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["AccessoryRestart"]

SPINDLE_LOG2, COOLANT_LOG2 = 12, 10
"""Of the times in ms: close to GRBL's 4 s and 1 s."""

MAX_LOG2 = 16


class AccessoryRestart(wiring.Component):
    """Turns spindle and coolant off, and on again one after the other.

    First the spindle, which has a time to reach its speed, then the coolant, which has one, too.
    What need not be waited for has none. A laser comes on last, and has none.

    Parameters
    ----------
    spindle_log2, coolant_log2 : int
        Of the two times in beats, from 0 to 16, the second at most the first. They begin between
        two beats, so that the first beat may come at once.

    Members
    -------
    beat : In(1)
        A beat, such as one a ms, for one clock.
    off : In(1)
        Turn both off, from the next clock on.
    restart : In(1)
        Turn them on; until `restarted`, or until ``off`` is 1 again.
    release : In(1)
        Neither is off any more, without a wait: from the next clock on, unless ``off`` is 1.
    spindle, coolant : In(1)
        There is something to be waited for: when it is turned on.
    laser : In(1)
        The spindle is a laser.
    spindle_off, coolant_off : Out(1)
        It is off, whatever the program wants.
    restarted : Out(1)
        Neither is off, and the last of the times is over.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    beat: In(1)
    off: In(1)
    restart: In(1)
    release: In(1)
    spindle: In(1)
    coolant: In(1)
    laser: In(1)
    spindle_off: Out(1)
    coolant_off: Out(1)
    restarted: Out(1)

    def __init__(self, *, spindle_log2: int = SPINDLE_LOG2, coolant_log2: int = COOLANT_LOG2
                 ) -> None:
        self.spindle_log2 = in_range("spindle_log2", spindle_log2, 0, MAX_LOG2)
        self.coolant_log2 = in_range("coolant_log2", coolant_log2, 0, self.spindle_log2)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()
        # Beats, less one; below 0 it is over, and it is -1 then: a time begins as its bits from
        # that of its power of two on are cleared.
        left = Signal(signed(self.spindle_log2 + 1), init=-1)
        over, goes = Signal(), Signal()
        m.d.comb += [over.eq(left[-1]), goes.eq(self.restart & over),
                     self.restarted.eq(over & ~self.spindle_off & ~self.coolant_off)]
        m.d.sync += left.eq(left - (self.beat & ~over))
        with m.If(goes):
            with m.If(self.spindle_off & ~(self.laser & self.coolant_off)):
                m.d.sync += self.spindle_off.eq(0)
                with m.If(self.spindle & ~self.laser):
                    m.d.sync += left[self.spindle_log2:].eq(0)
            with m.Else():
                m.d.sync += self.coolant_off.eq(0)
                with m.If(self.coolant_off & self.coolant):
                    m.d.sync += left[self.coolant_log2:].eq(0)
        with m.If(self.release | self.off):
            m.d.sync += [self.spindle_off.eq(self.off), self.coolant_off.eq(self.off), left.eq(-1)]
        return m
