"""Contract of simple movements and the four counts."""

from amaranth import Mux

from fresa.motion import AutomaticControl

from .contract import Bits, Case, Component, Contract
from .order_control import watch_order

__all__ = ["AUTOMATIC", "watch_counts"]


def watch_counts(c: Contract, path: str, *, reset: Bits) -> None:
    """State that the counters count what the motors make, and a movement makes what was ordered.

    `path` leads to the automatic control; `reset` is what resets it.
    """
    control = c.part(path)
    moves, moved, direction = control.moves, control.moved, control.direction
    at = (control.at_x, control.at_y, control.at_z)
    main = c.signal(f"{path}.main.count")
    state = c.state(f"{path}.orders.order_state")
    axes, steps = c.signal(f"{path}.orders.axes"), c.signal(f"{path}.orders.steps")
    was_reset = c.past(reset)
    for index, (name, position) in enumerate(zip("xyz", at, strict=True)):
        travel = c.keep(16, name=f"travel_{name}")  # forward less back
        made = c.keep(16, name=f"made_{name}")  # in this movement
        with c.m.If(reset):
            c.m.d.sync += [travel.eq(0), made.eq(0)]
        with c.m.Else():
            with c.m.If(moved[index]):
                c.m.d.sync += [travel.eq(travel + Mux(direction[index], 1, -1)), made.eq(made + 1)]
            with c.m.If(moves.valid & moves.ready & moves.p.axes.any()):
                c.m.d.sync += made.eq(0)
        taken = moves.valid & moves.ready & moves.p.axes.any()
        began = c.keep(16, name=f"began_{name}")
        with c.m.If(taken):
            c.m.d.sync += began.eq(position)
        c.invariant(f"{name}-moves-as-ordered",
                    f"A movement takes {name} as far as it has stepped, in the ordered direction.",
                    ~state("MOVING", "CLEAR")
                    | (position == (began + Mux(direction[index], made, -made))[:16]),
                    cover=state("CLEAR") & (position != began))
        c.invariant(f"{name}-position-is-net-steps",
                    f"The position of {name} is its steps forward less those back.",
                    position == travel, cover=travel != 0)
        c.implication(f"{name}-steps-of-the-order", f"At the end of a movement with {name}, "
                      f"{name} has made exactly the steps ordered.",
                      when=state("CLEAR") & axes[index], then=made == steps)
        c.implication(f"{name}-still-without-order", f"A movement without {name} makes no step "
                      "of it.",
                      when=state("CLEAR") & ~axes[index], then=made == 0)
        c.invariant(f"{name}-main-counts-steps", f"While {name} moves, the main counter is the "
                    "steps it made.",
                    ~state("MOVING", "CLEAR") | (made == Mux(axes[index], main, 0)),
                    cover=state("MOVING") & (made == 1))
    c.implication("reset-is-the-origin", "A reset makes the present position the origin.",
                  when=was_reset, then=(at[0] == 0) & (at[1] == 0) & (at[2] == 0) & (main == 0))


def describe(c: Contract, dut: AutomaticControl) -> None:
    """Positions follow the motors; a movement makes the steps ordered, whatever is refused."""
    # Motors may refuse any step, but all or none of a movement, and move only on request.
    c.assume((dut.moved == 0) | (dut.moved == dut.step))
    main = c.signal("main.count")
    watch_order(c, "orders", reset=c.rst)
    watch_counts(c, "", reset=c.rst)
    state = c.state("orders.order_state")
    for code, (name, count) in enumerate(
        [("main", main), ("x", dut.at_x), ("y", dut.at_y), ("z", dut.at_z)]):
        c.implication(f"shows-{name}", f"Choice {code} shows the count {name}.",
                      when=(dut.select == code) & count.any(), then=dut.shown == count)
    c.implication("refused-not-counted", "A requested step that is refused is not "
                  "counted.", when=c.past(dut.step.any() & (dut.moved == 0) & ~c.rst),
                  then=(main == c.past(main)) & (dut.at_x == c.past(dut.at_x))
                  & (dut.at_y == c.past(dut.at_y)) & (dut.at_z == c.past(dut.at_z)))
    c.implication("ready-is-rest", "A move can come exactly at rest.",
                  when=dut.moves.ready, then=state("REST") & ~dut.step.any())


AUTOMATIC = Component(
    make=AutomaticControl, describe=describe, depth=14,
    cases=(*(Case({"period": period}) for period in (2, 1)), Case({"period": 493_214}, real=True),
           Case({"period": 2}, upset=True)))
