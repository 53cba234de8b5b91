"""The backlash of gears."""

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_BACKLASH", "Backlash"]

MAX_BACKLASH = 2**20
"""Most steps of backlash: 18 mm of the micropositioner, more than its travel."""


class Backlash(wiring.Component):
    """Tells the steps that move the load from those that only take up backlash.

    Where a motor reverses, its first ``backlash`` steps turn gears and move nothing. Here they are
    left
    out of what is counted, so whoever goes by the count asks for as many more. A movement that is
    reversed again while it takes up backlash has the rest of the backlash to go back through, no
    more.

    At power-up the load is taken to rest where a movement down leaves it. A reset moves no gear and
    changes nothing. A new ``backlash`` counts from the next reversal on.

    Parameters
    ----------
    max_backlash : int
        Most steps of backlash, from 1 to ``MAX_BACKLASH``.

    Members
    -------
    backlash : In(range(max_backlash + 1))
        Steps that a reversal takes up; 0 for none.
    moved, direction : In(1)
        The motor makes a step, and which.
    counted : Out(1)
        The step moves the load: whoever keeps the position counts this.

    Raises
    ------
    ValueError
        If ``max_backlash`` is out of range.
    """

    def __init__(self, *, max_backlash: int) -> None:
        self.max_backlash = in_range("max_backlash", max_backlash, 1, MAX_BACKLASH)
        super().__init__({"backlash": In(range(self.max_backlash + 1)), "moved": In(1),
                          "direction": In(1), "counted": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()

        way = Signal(reset_less=True)  # of the last step
        left = Signal.like(self.backlash, reset_less=True)  # to take up, this way
        ahead = Signal.like(left)  # to take up, in the direction of this step
        # the backlash may have become less
        back = Mux(left > self.backlash, 0, self.backlash - left)
        m.d.comb += [
            ahead.eq(Mux(self.direction == way, left, back)),
            self.counted.eq(self.moved & (ahead == 0)),
        ]
        with m.If(self.moved):
            m.d.sync += [
                way.eq(self.direction),
                left.eq(Mux(ahead == 0, 0, ahead - 1)),
            ]

        return m
