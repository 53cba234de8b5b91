"""The backlash of gears."""

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_BACKLASH", "Backlash"]

MAX_BACKLASH = 2**20
"""Most steps of backlash that can be counted."""


class Backlash(wiring.Component):
    """Backlash compensation: tells steps that move the load from steps that take up backlash.

    After a reversal the first ``backlash`` steps turn gears and move nothing. They are not counted,
    so a position that counts ``counted`` makes its controller request as many more. A movement that
    is reversed again while it takes up backlash goes back through only what it has taken up.

    At power-up the load is assumed to rest where a movement down leaves it. A reset moves no gear
    and changes nothing. A new ``backlash`` applies from the next reversal on.

    Parameters
    ----------
    max_backlash : int
        Most steps of backlash, from 1 to ``MAX_BACKLASH``.

    Members
    -------
    backlash : In(range(max_backlash + 1))
        Steps that a reversal takes up; 0 for none.
    moved, direction : In(1)
        The motor makes a step in this clock, and its direction.
    counted : Out(1)
        The step moves the load: use it as count enable of the position.

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

        way = Signal(reset_less=True)  # direction of the last step
        left = Signal.like(self.backlash, reset_less=True)  # still to take up in that direction
        ahead = Signal.like(left)  # still to take up in the direction of this step
        # `backlash` may have been made smaller meanwhile
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
