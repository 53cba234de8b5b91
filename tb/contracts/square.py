"""Contract of the square in the air."""

from amaranth import Mux

from fresa.motion import SquareGenerator, square

from .contract import Bug, Case, Component, Contract

__all__ = ["SQUARE"]


def describe(c: Contract, dut: SquareGenerator) -> None:
    """Four corners in their order, each offered until it is taken."""
    state = c.state("square_state")
    orders = dut.orders
    payload = orders.payload.as_value()
    taken = orders.valid & orders.ready
    corner = c.keep(3, name="corner")  # corners taken since the start
    with c.m.If(c.rst | ~dut.busy):
        c.m.d.sync += corner.eq(0)
    with c.m.Elif(taken):
        c.m.d.sync += corner.eq(corner + 1)
    c.holds("stream-keeps", "An order that is offered stays, as it is, until it is taken.",
            when=c.past(orders.valid & ~orders.ready & ~c.rst),
            then=orders.valid & (payload == c.past(payload)),
            bug=Bug(square, "with m.If(self.orders.ready):", "with m.If(1):"))
    for number, (x, y) in enumerate([(1, 0), (1, 1), (0, 1), (0, 0)]):
        c.holds(f"corner-{number + 1}",
                f"Order {number + 1} goes to ({'side' if x else 0}, {'side' if y else 0}).",
                when=orders.valid & (corner == number),
                then=(orders.p.x == x * dut.side) & (orders.p.y == y * dut.side),
                bug=(Bug(square, "Mux(far_x, self.side, 0)", "Mux(far_y, self.side, 0)")
                     if x != y else Bug(square, "Mux(far_y, self.side, 0)",
                                        f"Mux(far_y, self.side - {y}, {1 - y})")))
    c.holds("in-the-air", "No order is one for the tool.",
            when=orders.valid, then=~orders.p.up & ~orders.p.down,
            bug=Bug(square, "self.orders.valid.eq(1),",
                    "self.orders.valid.eq(1), self.orders.p.up.eq(far_x),"))
    c.holds("busy-orders", "While it is busy an order is offered, and else none.",
            when=dut.busy | orders.valid, then=dut.busy & orders.valid,
            bug=Bug(square, "self.busy.eq(1),", "self.busy.eq(~self.start),"))
    c.holds("four-orders", "It is over when four orders are taken.",
            when=c.past(taken & (corner == 3)), then=~dut.busy,
            bug=Bug(square, '("SIDE-4", [], "IDLE")', '("SIDE-4", [], "SIDE-1")'))
    c.holds("not-before", "It is not over before four orders are taken.",
            when=c.past(taken & (corner < 3) & ~c.rst), then=dut.busy,
            bug=Bug(square, '("SIDE-3", [far_y], "SIDE-4")', '("SIDE-3", [far_y], "IDLE")'))
    c.holds("starts", "A start begins it unless it is busy.",
            when=c.past(dut.start & ~dut.busy & ~c.rst), then=dut.busy & (corner == 0),
            bug=Bug(square, "with m.If(self.start):", "with m.If(self.start & self.orders.ready):"))
    c.holds("start-while-busy", "A start on the way changes nothing.",
            when=c.past(dut.start & dut.busy & ~orders.ready & ~c.rst),
            then=state.register == c.past(state.register),
            bug=Bug(square, "with m.If(self.orders.ready):",
                    "with m.If(self.orders.ready | self.start):"))
    c.holds("no-start-no-order", "Without a start nothing is ordered.",
            when=c.past(~dut.start & ~dut.busy), then=~orders.valid,
            bug=Bug(square, "with m.If(self.start):", "with m.If(1):"))
    c.always("corner-is-the-state", "The state is the number of corners taken.",
             Mux(dut.busy, state("SIDE-1", "SIDE-2", "SIDE-3", "SIDE-4")
                 & (state.register - 1 == corner), 1), seen=corner == 3,
             bug=Bug(square, '("SIDE-1", [far_x], "SIDE-2")', '("SIDE-1", [far_x], "SIDE-3")'))
    c.leaves_unused_codes("square_state", fault=dut.fault, shows=~dut.busy & ~orders.valid,
                          reached=Bug(square, '("SIDE-4", [], "IDLE")', '("SIDE-4", [], "FAULT")'))


SQUARE = Component(
    make=SquareGenerator, describe=describe, depth=8,
    cases=(Case({"side": 3}), Case({"side": 1}), Case({"side": 51_200}), Case({"side": 3},
                                                                              upset=True)))
