"""Contract of the square in the air."""

from amaranth import Mux

from fresa.motion import SquareGenerator

from .contract import Case, Component, Contract

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
    c.implication("stable-until-ready", "An order that is offered stays, unchanged, until it is "
                  "taken.",
                  when=c.past(orders.valid & ~orders.ready & ~c.rst),
                  then=orders.valid & (payload == c.past(payload)))
    for number, (x, y) in enumerate([(1, 0), (1, 1), (0, 1), (0, 0)]):
        c.implication(f"corner-{number + 1}",
                      f"Order {number + 1} goes to ({'side' if x else 0}, {'side' if y else 0}).",
                      when=orders.valid & (corner == number),
                      then=(orders.p.x == x * dut.side) & (orders.p.y == y * dut.side))
    c.implication("no-tool-order", "No order is one for the tool.",
                  when=orders.valid, then=~orders.p.up & ~orders.p.down)
    c.implication("busy-offers-order", "While it is busy an order is offered, and else none.",
                  when=dut.busy | orders.valid, then=dut.busy & orders.valid)
    c.implication("four-orders", "It is over when four orders are taken.",
                  when=c.past(taken & (corner == 3)), then=~dut.busy)
    c.implication("not-before", "It is not over before four orders are taken.",
                  when=c.past(taken & (corner < 3) & ~c.rst), then=dut.busy)
    c.implication("start-begins", "A start begins it unless it is busy.",
                  when=c.past(dut.start & ~dut.busy & ~c.rst), then=dut.busy & (corner == 0))
    c.implication("start-while-busy", "A start on the way changes nothing.",
                  when=c.past(dut.start & dut.busy & ~orders.ready & ~c.rst),
                  then=state.register == c.past(state.register))
    c.implication("no-start-no-order", "Without a start nothing is ordered.",
                  when=c.past(~dut.start & ~dut.busy), then=~orders.valid)
    c.invariant("corner-is-the-state", "The state is the number of corners taken.",
                Mux(dut.busy, state("SIDE-1", "SIDE-2", "SIDE-3", "SIDE-4")
                    & (state.register - 1 == corner), 1), cover=corner == 3)
    c.leaves_unused_codes("square_state", fault=dut.fault, shows=~dut.busy & ~orders.valid)


SQUARE = Component(
    make=SquareGenerator, describe=describe, depth=8,
    cases=(Case({"side": 3}), Case({"side": 1}), Case({"side": 51_200}), Case({"side": 3},
                                                                              upset=True)))
