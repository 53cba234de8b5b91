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
    the position, and the target is expected to be 0 after it, or `run`, so that a reset moves
    nothing.

    Parameters
    ----------
    width : int
        Bits of positions, from 2 to 64. Positions are signed.

    Members
    -------
    target_n : In(signed(width))
        Target position, with all bits inverted: the carry chain of a comparison needs one operand
        inverted, and a register in front of this port holds it so at no cost.
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
        1 up, 0 down; 1 at the target.
    position : Out(signed(width))
        Present position, in steps.
    in_position : Out(1)
        The position is the target.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int = 32) -> None:
        self.width = in_range("width", width, 2, 64)
        super().__init__({
            "target_n": In(signed(self.width)), "run": In(1),
            "load": In(1), "place": In(signed(self.width)), "moved": In(1),
            "step": Out(1), "direction": Out(1), "position": Out(signed(self.width)),
            "in_position": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        beyond = Signal(signed(self.width + 1))  # by how much more than a step, if not negative
        m.d.comb += [
            beyond.eq(self.position + self.target_n),
            self.direction.eq(beyond[-1]),
            self.in_position.eq((self.position ^ self.target_n).all()),
            self.step.eq(self.run & ~self.load & ~self.in_position),
        ]
        with m.If(self.load):
            m.d.sync += self.position.eq(self.place)
        with m.Elif(self.moved):
            m.d.sync += self.position.eq(self.position + Mux(self.direction, 1, -1))

        return m
