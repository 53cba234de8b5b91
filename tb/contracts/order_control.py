"""Contract of one simple movement."""

from amaranth import Mux, Value

from fresa.motion import OrderControl

from .contract import Bits, Case, Component, Contract

__all__ = ["ORDER_CONTROL", "watch_order"]


def watch_order(c: Contract, path: str, *, reset: Bits) -> None:
    """State what holds of an order control wherever it is; `reset` is what resets it.

    The count must begin at 0 with `clear`, and go up by one at most, and only with a step.
    """
    orders = c.part(path)
    moves, step, count, clear = orders.moves, orders.step, orders.count, orders.clear
    period = orders.period
    state = c.state(f"{path}.order_state")
    axes, steps = c.signal(f"{path}.axes"), c.signal(f"{path}.steps")
    taken = moves.valid & moves.ready & moves.p.axes.any()
    c.implication("ready-only-at-rest", "A move is taken only at rest.",
                  when=Value.cast(moves.ready), then=state("REST"))
    c.implication("takes-the-move", "A move that is taken is under way in the next clock.",
                  when=c.past(taken & ~reset),
                  then=state("MOVING") & (axes == c.past(moves.p.axes))
                  & (steps == c.past(moves.p.steps)))
    c.implication("move-stays", "A movement keeps its axes and steps to its end.",
                  when=c.past(state("MOVING") & ~reset),
                  then=(axes == c.past(axes)) & (steps == c.past(steps)))
    c.implication("direction-holds", "The direction stays from one move to the next.",
                  when=c.past(~(moves.valid & moves.ready) & ~reset),
                  then=orders.direction == c.past(orders.direction))
    c.implication("direction-of-the-move", "A step has the direction of its move.",
                  when=c.past(taken & ~reset),
                  then=orders.direction == c.past(moves.p.direction))
    c.implication("begins-at-0", "A movement counts from 0.",
                  when=c.past(taken & ~reset), then=count == 0)
    c.implication("clears-only-to-begin", "The count is cleared only where a movement begins.",
                  when=clear, then=taken)
    c.implication("steps-only-moving", "A step is requested only while moving.",
                  when=step.any(), then=state("MOVING"))
    c.implication("axes-together", "A step is requested of all axes of the move, and of no other.",
                  when=step.any(), then=step == axes)
    c.invariant("never-past-the-end", "The count never passes the steps ordered.",
                ~state("MOVING") | (count <= steps), cover=state("MOVING") & (count == 2))
    c.implication("exactly-the-steps", "A movement ends when the count is the steps ordered.",
                  when=state("CLEAR"), then=count == steps)
    c.implication("ends", "Where the steps are made the movement is over two clocks later.",
                  when=c.past(state("MOVING") & (count >= steps) & ~reset), then=state("CLEAR"))
    c.implication("continues", "The movement continues while steps are missing.",
                  when=c.past(state("MOVING") & (count < steps) & ~reset), then=state("MOVING"))
    c.implication("no-axes-left", "At rest no axis is left over from the last movement.",
                  when=state("REST"), then=axes == 0)

    c.implication("moves-some-axis", "A movement has an axis that moves.",
                  when=state("MOVING"), then=axes.any())

    # How the steps lie in time
    since_request = c.keep(range(period + 1), init=period, name="since_request")
    with c.m.If(reset | taken | step.any()):
        c.m.d.sync += since_request.eq(0)
    with c.m.Elif(since_request < period):
        c.m.d.sync += since_request.eq(since_request + 1)
    c.implication("ends-after-last-step", "When all steps are made, the last was requested in the "
                  "clock before.",
                  when=state("MOVING") & (count >= steps), then=since_request == 0)
    if period > 1:
        c.implication("timing", "A step is requested `period` clocks after the last one or the "
                      "start.", when=step.any(), then=since_request == period - 1)
        ticks = c.signal(f"{path}.divider.count")
        c.invariant("timing-is-the-count", "The divider counts the clocks to the next step.",
                    Mux(state("MOVING"), ticks == since_request - (period - 1), 1)
                    & (ticks <= 0) & (ticks >= 1 - period), cover=ticks == 0)
        c.implication("divider-at-rest", "At rest the divider is at the start of its period.",
                      when=state("REST"), then=ticks == 1 - period)
    c.leaves_unused_codes(
        f"{path}.order_state", fault=orders.fault, shows=~step.any() & ~moves.ready & ~clear,
        reset=reset)


def describe(c: Contract, dut: OrderControl) -> None:
    """Each movement asks for the steps ordered, `period` clocks apart, and for no more."""
    # The main counter, and motors that refuse as they please.
    count = c.keep(16, name="main_counter")
    made = c.past(dut.step.any()) & (dut.count != count)
    cleared, was_reset = c.past(dut.clear), c.past(c.rst)
    c.m.d.sync += count.eq(dut.count)
    c.assume(Mux(was_reset | ~c.past(1) | cleared, dut.count == 0,
                 (dut.count == count) | (c.past(dut.step.any()) & (dut.count == count + 1))))
    watch_order(c, "", reset=c.rst)
    state = c.state("order_state")
    c.implication("counted-only-on-request", "Counted steps were requested.", when=made,
                  then=c.past(state("MOVING")))
    c.implication("no-axes-no-move", "A move without axes is over at once.",
                  when=c.past(dut.moves.valid & dut.moves.ready & ~dut.moves.p.axes.any()),
                  then=state("REST"))
    c.implication("refused-step-retried", "A step that is refused is requested again at the next "
                  "tick.",
                  when=state("MOVING") & (dut.count < c.signal("steps")) & c.signal("divider.tick"),
                  then=dut.step == c.signal("axes"))
    c.implication("reset-ends-movement", "Reset ends a movement.", when=was_reset,
                  then=state("REST") & dut.moves.ready & ~dut.step.any())


ORDER_CONTROL = Component(
    make=OrderControl, describe=describe, depth=16,
    cases=(*(Case({"period": period}) for period in (2, 1, 3)),
           Case({"period": 493_214}, real=True), Case({"period": 2}, upset=True)))
