"""Contract of the part that splits an order into simple movements."""

from amaranth import Cat, Mux, Value

from fresa.motion import MotionSequencer

from .contract import Bits, Case, Component, Contract
from .targets import WholeOrders, watch_targets

__all__ = ["SEQUENCER"]


def describe(c: Contract, dut: MotionSequencer) -> None:
    """Orders are taken, split, offered and refused as in the table of states."""
    state = c.state("motion_state")
    moves, order = dut.moves, dut.order
    was_reset, known = c.past(c.rst), c.past(1)
    # A move that is taken is under way until its taker is ready again; only then a position
    # changes, and not in the last clock.
    under_way = c.keep(1, name="under_way")
    with c.m.If(c.rst):
        c.m.d.sync += under_way.eq(0)
    with c.m.Elif(moves.valid & moves.ready):
        c.m.d.sync += under_way.eq(moves.p.axes.any())
    with c.m.Elif(moves.ready):
        c.m.d.sync += under_way.eq(0)
    moving = ~Value.cast(moves.ready)
    c.assume(~known | was_reset | c.past(under_way & moving) | (_at(dut) == c.past(_at(dut))))
    c.invariant("waits-while-moving", "While a move is under way it waits.",
                ~under_way | state("WAIT", "DIAG-WAIT", "TOOL-WAIT"), cover=under_way)
    if isinstance(dut, WholeOrders):
        watch_targets(c, dut, under_way)
    started = c.signal("started")
    begins = dut.start & ~started
    taken = dut.ready & begins
    tool = order.up | order.down

    # Orders in
    c.implication("ready-at-rest", "Ready is only at rest and while nothing holds it.",
                  when=dut.ready, then=state("REST") & ~dut.hold)
    c.implication("rest-is-ready", "At rest it is ready unless something holds it.",
                  when=state("REST") & ~dut.hold, then=dut.ready)
    c.implication("ready-falls", "After any order ready falls in the next clock.",
                  when=c.past(taken & ~c.rst), then=~dut.ready)
    used = c.keep(1, name="used")
    c.m.d.sync += used.eq(dut.start & (used | (taken & ~c.rst)))
    c.invariant("start-remembered", "A start that was taken is remembered until it falls.",
                ~used | c.signal("started"), cover=used)
    spent = c.keep(1, name="spent")
    c.m.d.sync += spent.eq(dut.start & (spent | (dut.ready & ~c.rst) | ~state("REST")))
    c.invariant("start-consumed", "A start is consumed where it is taken or comes while busy, and "
                "not while held.", started == spent, cover=spent & dut.ready)
    c.implication("level-once", "A start that stays high is taken once, also through resets.",
                  when=used & dut.start & state("REST"),
                  then=~taken)
    c.implication("no-start-no-move", "Without an order nothing begins.",
                  when=c.past(state("REST") & ~taken), then=state("REST"))
    c.implication("hold-blocks-orders", "While held no order is taken.",
                  when=c.past(state("REST") & dut.hold), then=state("REST"))
    for name, goal, target in [("x", c.signal("goal_x"), order.x),
                               ("y", c.signal("goal_y"), order.y)]:
        c.implication(f"goal-{name}",
                      f"The goal in {name} is the target of the clock in which it is taken.",
                      when=c.past(taken & ~c.rst), then=goal == c.past(target))
        c.implication(f"goal-{name}-stays", f"The goal in {name} does not change while busy.",
                      when=c.past(~state("REST") & ~c.rst), then=goal == c.past(goal))
    c.implication("decides", "An order without up or down is decided on in the next clock.",
                  when=c.past(taken & ~tool & ~c.rst), then=state("DECIDE"))
    c.implication("tool-orders", "An order with up or down alone is one for the tool.",
                  when=c.past(taken & (order.up ^ order.down) & ~c.rst), then=state("TOOL"))

    # Refusals
    past_steps = {name: c.past(c.signal(f"steps_{name}")) for name in "xy"}
    was_decide = c.past(state("DECIDE") & ~c.rst)
    was_low = c.past(dut.at_z[-1])
    some_x, some_y = past_steps["x"] != 0, past_steps["y"] != 0
    oblique = some_x & some_y & (past_steps["x"] != past_steps["y"])
    c.implication("up-and-down", "Up and down together are refused, and nothing moves.",
                  when=c.past(taken & order.up & order.down & ~c.rst), then=state("TOOL-WAIT")
                  & dut.error)
    c.implication("oblique-milling", "A lowered tool goes only where one of 8 directions leads.",
                  when=was_decide & was_low & oblique, then=state("REST") & dut.error)
    c.implication("nothing-to-do", "An order to where it stands is over at once, without error.",
                  when=was_decide & ~some_x & ~some_y & ~c.past(begins & tool),
                  then=state("REST") & ~dut.error)
    c.implication("interrupted", "A tool order that begins while another is under way is refused.",
                  when=c.past(~state("REST") & begins & tool & ~c.rst), then=dut.error)
    c.implication("start-while-busy", "A start on the way changes neither state nor goal.",
                  when=c.past(state("WAIT") & moving & dut.start & ~c.rst), then=state("WAIT"))
    c.implication("error-has-a-cause", "An error comes only of an order that was refused.",
                  when=dut.error & ~c.past(dut.error),
                  then=c.past(begins & (dut.ready | ~state("REST")) & tool) | was_decide & was_low
                  & oblique)
    c.implication("error-stays", "An error stays until reset or an order that is not refused.",
                  when=c.past(dut.error & ~c.rst) & ~dut.error, then=c.past(state("DECIDE",
                                                                                  "TOOL")))
    c.implication("error-cleared", "An order that is carried out ends the error of the one before.",
                  when=c.past(state("TOOL") & ~(begins & tool) & ~c.rst), then=~dut.error)

    # From state to state
    unequal = past_steps["x"] != past_steps["y"]
    c.implication("equal-together", "Equal distances are moved together.",
                  when=was_decide & (some_x | some_y) & ~unequal, then=state("TOGETHER"))
    c.implication("unequal-diagonal-first", "Unequal distances begin with the diagonal.",
                  when=was_decide & unequal & ~(was_low & oblique), then=state("DIAGONAL"))
    offer_over = c.past((moves.ready | ~moves.valid) & ~c.rst)
    for last in ("TOGETHER", "STRAIGHT"):
        c.implication(f"{last.lower()}-is-last", f"{last} is waited for as the last movement.",
                      when=offer_over & c.past(state(last)), then=state("WAIT"))
    for first, wait in [("DIAGONAL", "DIAG-WAIT"), ("TOOL", "TOOL-WAIT")]:
        c.implication(f"{first.lower()}-then-wait", f"After {first} comes {wait}.",
                      when=offer_over & c.past(state(first)), then=state(wait))
    c.implication("diagonal-then-straight", "Where the diagonal is over the straight rest comes.",
                  when=c.past(state("DIAG-WAIT") & moves.ready & ~c.rst), then=state("STRAIGHT"))
    c.implication("rest-when-done", "Where the last movement is over it rests.",
                  when=c.past(state("WAIT", "TOOL-WAIT") & moves.ready & ~c.rst),
                  then=state("REST"))

    # Arithmetic: steps to go follow goal and position by a clock
    for name in "xy":
        at, goal = getattr(dut, f"at_{name}"), c.signal(f"goal_{name}")
        target = Mux(state("REST"), getattr(order, name), goal)
        beyond = at - target
        far = c.past(Mux(beyond < 0, -beyond, beyond)[:16])
        c.implication(f"steps-{name}", f"The steps to go in {name} are the distance to the goal.",
                      when=known & ~was_reset, then=c.signal(f"steps_{name}") == far)
        c.implication(f"direction-{name}", f"The direction in {name} is ascending if the goal is "
                      "beyond.", when=known & ~was_reset,
                      then=c.signal(f"ascending_{name}") == c.past(target > at))

    # Moves out
    steps_x, steps_y = c.signal("steps_x"), c.signal("steps_y")
    least = Mux(steps_x < steps_y, steps_x, steps_y)
    most = Mux(steps_x < steps_y, steps_y, steps_x)
    c.implication("together", "Equal distances are one movement of both axes.",
                  when=state("TOGETHER"), then=moves.valid & (moves.p.axes == 0b011)
                  & (steps_x == steps_y) & (moves.p.steps == steps_x))
    if not isinstance(dut, WholeOrders):  # their proof takes long enough without it
        c.implication("together-moves", "The diagonal part has at least a step.",
                      when=state("TOGETHER"), then=steps_x != 0)
    c.implication("diagonal", "Unequal distances begin with a diagonal of the smaller.",
                  when=state("DIAGONAL") & moves.valid, then=(moves.p.axes == 0b011)
                  & (moves.p.steps == least) & (least != 0))
    c.implication("no-diagonal-of-0", "A diagonal of no steps is left out.",
                  when=state("DIAGONAL") & (least == 0), then=~moves.valid)
    c.implication("straight", "The rest is a movement of the axes that are not there yet.",
                  when=state("STRAIGHT"), then=moves.valid & (moves.p.steps == most)
                  & (moves.p.axes == Cat(steps_x != 0, steps_y != 0)))
    c.implication("move-directions", "A move goes towards the goal.",
                  when=moves.valid & ~state("TOOL"),
                  then=moves.p.direction[:2] == Cat(c.signal("ascending_x"),
                                                    c.signal("ascending_y")))
    low = dut.at_z[-1]
    c.implication("tool-moves", "The tool moves up from below and down from above, by its travel.",
                  when=state("TOOL") & moves.valid,
                  then=(moves.p.axes == 0b100) & (moves.p.steps == dut.z_travel)
                  & (moves.p.direction[2] == low))
    c.implication("tool-not-moved-twice", "A raised tool is not raised, a lowered one not lowered.",
                  when=state("TOOL") & (c.signal("raising") != low), then=~moves.valid)
    c.implication("stable-until-ready", "A move that is offered stays, unchanged, until it is "
                  "taken.",
                  when=c.past(moves.valid & moving & ~c.rst),
                  then=moves.valid & (moves.payload.as_value() == c.past(moves.payload.as_value())))
    c.implication("waits-for-the-end", "It is not at rest before the movement is over.",
                  when=c.past(moving & state("WAIT", "DIAG-WAIT", "TOOL-WAIT") & ~c.rst),
                  then=~state("REST") & (state.register == c.past(state.register)))
    c.implication("reset-ends-order", "Reset ends every order.", when=was_reset, then=state("REST")
                  & ~dut.error)
    c.leaves_unused_codes(
        "motion_state", fault=dut.fault, shows=~dut.ready & ~moves.valid & dut.error)


def _at(dut: MotionSequencer) -> Bits:
    return Cat(dut.at_x, dut.at_y, dut.at_z)


def make(*, z_travel: int, whole_orders: bool = False) -> MotionSequencer:
    """Make a sequencer, with its orders watched as a whole or not."""
    return (WholeOrders if whole_orders else MotionSequencer)(z_travel=z_travel)


SEQUENCER = Component(
    make=make, describe=describe, depth=10,
    cases=(Case({"z_travel": 2}), Case({"z_travel": 1152}, real=True),
           Case({"z_travel": 2, "whole_orders": True}), Case({"z_travel": 2}, upset=True)))
