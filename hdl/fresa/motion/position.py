"""Moving to a position."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MoveTo"]


class MoveTo(wiring.Component):
    """Requests steps towards a target until the position has reached it.

    The position counts the steps that are made, and nothing else. Requests follow the target in the
    same clock: it may change at any time, also to one behind. Since every step goes towards a
    target the position never leaves the range of targets, so it cannot wrap. An endless movement is
    one to the end of that range.

    To stop, clear ``run``; then the target may be set to the position, which stays. A reset clears
    the position, and the target is expected to be 0 after it, so that a reset moves nothing.

    Parameters
    ----------
    width : int
        Bits of positions, from 2 to 64. Positions are signed.

    Members
    -------
    target : In(signed(width))
        Target position.
    run : In(1)
        Move towards it.
    load : In(1)
        Set the position to ``place``. No step is requested in this clock.
    place : In(signed(width))
        Position to set.
    moved : In(1)
        The requested step is made in this clock. Only with ``step``.
    step : Out(1)
        Step request.
    direction : Out(1)
        1 up, 0 down.
    position : Out(signed(width))
        Present position, in steps.

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
