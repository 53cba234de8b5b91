"""The thesis's first automatic test."""

from amaranth import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .orders import Order

__all__ = ["SquareGenerator"]


class SquareGenerator(wiring.Component):
    """Walks the four corners of a square in the air, once for every start (thesis, 5.3).

    The corners are (side, 0), (side, side), (0, side) and (0, 0), where it ends.

    Parameters
    ----------
    side : int
        Side of the square in steps, from 1 to 65 535.

    Members
    -------
    start : In(1)
        Begin, if not ``busy``.
    orders : Out(stream.Signature(Order))
        Orders.
    busy : Out(1)
        A walk is under way.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``side`` is out of range.
    """

    start: In(1)
    orders: Out(stream.Signature(Order))
    busy: Out(1)
    fault: Out(1)

    def __init__(self, *, side: int) -> None:
        self.side = in_range("side", side, 1, 65_535)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        far_x = Signal()
        far_y = Signal()
        m.d.comb += [
            self.orders.p.x.eq(Mux(far_x, self.side, 0)),
            self.orders.p.y.eq(Mux(far_y, self.side, 0)),
        ]
        with m.FSM(name="square_state") as fsm:
            with m.State("IDLE"):
                with m.If(self.start):
                    m.next = "SIDE-1"

            for state, far, after in [
                ("SIDE-1", [far_x], "SIDE-2"),
                ("SIDE-2", [far_x, far_y], "SIDE-3"),
                ("SIDE-3", [far_y], "SIDE-4"),
                ("SIDE-4", [], "IDLE"),
            ]:
                with m.State(state):
                    m.d.comb += [
                        self.busy.eq(1),
                        self.orders.valid.eq(1),
                        *(coordinate.eq(1) for coordinate in far),
                    ]
                    with m.If(self.orders.ready):
                        m.next = after

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
