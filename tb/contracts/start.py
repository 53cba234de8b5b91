"""Contract of the handshake between a stream of orders and a controller."""

from fresa.motion import StartHandshake

from .contract import Case, Component, Contract

__all__ = ["START"]


def describe(c: Contract, dut: StartHandshake) -> None:
    """Start is held until ready falls, and an order is taken when ready has risen again."""
    state = c.state("handshake_state")
    orders = dut.orders
    taken = orders.valid & orders.ready
    # The stream of orders keeps its rule.
    offered = c.past(orders.valid & ~orders.ready & ~c.rst)
    c.assume(~offered | (orders.valid & (orders.payload.as_value()
                                         == c.past(orders.payload.as_value()))))
    fell = c.keep(1, name="ready_fell")  # since start
    with c.m.If(c.rst | taken):
        c.m.d.sync += fell.eq(0)
    with c.m.Elif(dut.start & ~dut.ready):
        c.m.d.sync += fell.eq(1)
    c.implication("start-only-with-order", "Start is high only while an order waits.",
                  when=dut.start, then=orders.valid)
    c.implication("start-when-ready", "Start rises only after the controller was ready.",
                  when=dut.start & ~c.past(dut.start), then=c.past(dut.ready))
    c.implication("start-is-held", "Start stays until ready falls.",
                  when=c.past(dut.start & dut.ready & ~c.rst), then=dut.start)
    c.implication("start-falls", "Start falls when ready has fallen.",
                  when=c.past(dut.start & ~dut.ready), then=~dut.start)
    c.implication("taken-when-done", "An order is taken when ready has fallen and risen since "
                  "start.", when=taken, then=fell & dut.ready)
    c.implication("no-error-taken", "An order that ends in an error is never taken.",
                  when=orders.valid & dut.error & dut.ready, then=~taken)
    c.implication("one-at-a-time", "After an order is taken the next begins anew.",
                  when=c.past(taken), then=state("WAIT-READY") & ~dut.start)
    c.implication("order-stays", "The order to the controller stays from start until it is taken.",
                  when=c.past(dut.start & ~c.rst),
                  then=dut.order.as_value() == c.past(orders.payload.as_value()))
    c.implication("order-unchanged", "The order to the controller is the one of the stream.",
                  when=orders.valid, then=dut.order.as_value() == orders.payload.as_value())
    c.invariant("ready-fell-in-moving", "Ready has fallen exactly in the state that waits for it.",
                fell == state("MOVING"), cover=fell)
    c.implication("waits-with-order", "An order that is begun still waits in the stream.",
                  when=state("START", "MOVING"), then=orders.valid)
    c.implication("reset-restarts", "Reset aborts a handshake that was begun.",
                  when=c.past(c.rst), then=state("WAIT-READY") & ~dut.start)
    c.leaves_unused_codes("handshake_state", fault=dut.fault, shows=~dut.start & ~orders.ready)


START = Component(make=lambda: StartHandshake(), describe=describe, depth=8,
                  cases=(Case(), Case(upset=True)))
