"""Moving to a position."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MoveTo"]


class MoveTo(wiring.Component):
    """Asks for steps towards a target until the position is there.

    The position counts the steps that are made, and nothing else. What is asked for follows the
    target in the same clock: a new one may come at any time, also one behind. Since every step goes
    towards a target the position never leaves the range of targets, and there is nothing to wrap. A
    movement without end is one to the end of that range.

    To stop, take ``run`` away; then the target may be set to the position, which stays. A reset
    makes this place 0, as the target is after it, so that a reset moves nothing.

    Parameters
    ----------
    width : int
        Bits of positions, from 2 to 64. Positions are signed.

    Members
    -------
    target : In(signed(width))
        Where to go.
    run : In(1)
        Go there.
    load : In(1)
        Call this place ``place``. No step is asked for in this clock.
    place : In(signed(width))
        What to call it.
    moved : In(1)
        The step asked for is being made. Only given where ``step`` is.
    step : Out(1)
        Make a step.
    direction : Out(1)
        1 up, 0 down.
    position : Out(signed(width))
        Where it is.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int = 32) -> None:
        self.width = in_range("width", width, 2, 64)
        super().__init__({
            "target": In(signed(self.width)), "run": In(1),
            "load": In(1), "place": In(signed(self.width)), "moved": In(1),
            "step": Out(1), "direction": Out(1), "position": Out(signed(self.width)),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        below = Signal()
        m.d.comb += [
            below.eq(self.position < self.target),
            self.direction.eq(below),
            self.step.eq(self.run & ~self.load & (self.position != self.target)),
        ]
        with m.If(self.load):
            m.d.sync += self.position.eq(self.place)
        with m.Elif(self.moved):
            m.d.sync += self.position.eq(self.position + Mux(below, 1, -1))

        return m
