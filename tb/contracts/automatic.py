"""Contract of simple movements and the four counts."""

from amaranth import Mux

from fresa.motion import AutomaticControl, automatic

from .contract import Bits, Bug, Case, Component, Contract
from .order_control import watch_order

__all__ = ["AUTOMATIC", "watch_counts"]


def watch_counts(c: Contract, path: str, *, reset: Bits) -> None:
    """Promise that the counters count what the motors make, and a movement makes what was ordered.

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
        c.always(f"{name}-lands",
                 f"A movement takes {name} as far as it has stepped, the way told.",
                 ~state("MOVING", "CLEAR")
                 | (position == (began + Mux(direction[index], made, -made))[:16]),
                 seen=state("CLEAR") & (position != began),
                 bug=Bug(automatic, "counter.direction.eq(orders.direction[index])",
                         "counter.direction.eq(orders.direction[index] ^ main.count[0])"))
        c.always(f"{name}-counts-the-motor",
                 f"The position of {name} is the steps it made forward less those back.",
                 position == travel, seen=travel != 0,
                 bug=(Bug(automatic, "counter.step.eq(self.moved[index])",
                          "counter.step.eq(self.step[index])"),
                      Bug(automatic, "orders.direction[index]", "orders.direction[0]")
                      if index else
                      Bug(automatic, "orders.direction[index]", "orders.direction[1]")))
        c.holds(f"{name}-steps-of-the-order",
                f"At the end of a movement with {name}, {name} has made exactly the steps ordered.",
                when=state("CLEAR") & axes[index], then=made == steps,
                bug=Bug(automatic, "main.step.eq(self.moved.any())", "main.step.eq(1)"))
        c.holds(f"{name}-left-alone", f"A movement without {name} makes no step of it.",
                when=state("CLEAR") & ~axes[index], then=made == 0,
                bug=Bug(automatic, "self.step.eq(orders.step)",
                        "self.step.eq(orders.step.any().replicate(3))"))
        c.always(f"{name}-made-is-main", f"While {name} moves the main counter is what it made.",
                 ~state("MOVING", "CLEAR") | (made == Mux(axes[index], main, 0)),
                 seen=state("MOVING") & (made == 1),
                 bug=Bug(automatic, "main.clear.eq(orders.clear)", "main.clear.eq(0)"))
    c.holds("reset-is-the-origin", "A reset makes the place where it stands the origin.",
            when=was_reset, then=(at[0] == 0) & (at[1] == 0) & (at[2] == 0) & (main == 0),
            bug=Bug(automatic, "position.eq(counter.count)",
                    "position.eq(counter.count ^ main.count ^ 1)"))


def describe(c: Contract, dut: AutomaticControl) -> None:
    """Positions follow the motors; a movement makes the steps ordered, whatever is refused."""
    # Motors refuse as they please, but all or none of a movement, and move only when asked.
    c.assume((dut.moved == 0) | (dut.moved == dut.step))
    main = c.signal("main.count")
    watch_order(c, "orders", reset=c.rst)
    watch_counts(c, "", reset=c.rst)
    state = c.state("orders.order_state")
    for code, (name, count) in enumerate(
        [("main", main), ("x", dut.at_x), ("y", dut.at_y), ("z", dut.at_z)]):
        c.holds(f"shows-{name}", f"Choice {code} shows the count {name}.",
                when=(dut.select == code) & count.any(), then=dut.shown == count,
                bug=Bug(automatic, "Mux(high, Mux(low, self.at_z, self.at_y), "
                        "Mux(low, self.at_x, main.count))",
                        "Mux(high, Mux(low, self.at_y, self.at_z), "
                        "Mux(low, main.count, self.at_x))"))
    c.holds("refused-not-counted", "A step that is asked for and refused is counted by nobody.",
            when=c.past(dut.step.any() & (dut.moved == 0) & ~c.rst),
            then=(main == c.past(main)) & (dut.at_x == c.past(dut.at_x))
            & (dut.at_y == c.past(dut.at_y)) & (dut.at_z == c.past(dut.at_z)),
            bug=(Bug(automatic, "main.step.eq(self.moved.any())", "main.step.eq(self.step.any())"),
                 Bug(automatic, "counter.step.eq(self.moved[index])",
                     "counter.step.eq(self.step[index])")))
    c.holds("ready-is-rest", "A move can come exactly at rest.",
            when=dut.moves.ready, then=state("REST") & ~dut.step.any(),
            bug=Bug(automatic, "self.fault.eq(orders.fault)",
                    "self.fault.eq(orders.fault), self.step.eq(orders.step | orders.moves.ready)"))


AUTOMATIC = Component(
    make=AutomaticControl, describe=describe, depth=14,
    cases=(*(Case({"period": period}) for period in (2, 1)), Case({"period": 493_214}, real=True),
           Case({"period": 2}, upset=True)))
