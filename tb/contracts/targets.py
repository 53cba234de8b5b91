"""Contract of whole orders: when it is ready again, the machine is at the target.

What carries out the moves is stated elsewhere to land where each leads (:mod:`.automatic`); that
is assumed here.
"""

from amaranth import Cat, Mux

from fresa.motion import MotionSequencer

from .contract import Bits, Contract

__all__ = ["WholeOrders", "watch_targets"]


class WholeOrders(MotionSequencer):
    """A sequencer whose orders are watched from their taking to their end; it takes minutes."""


def watch_targets(c: Contract, dut: MotionSequencer, under_way: Bits) -> None:
    """State where an order ends; `under_way` is 1 while a move that was taken is carried out."""
    motion, moves, order = c.state("motion_state"), dut.moves, dut.order
    at = (dut.at_x, dut.at_y, dut.at_z)

    # A move that was taken, and where it leads
    ends_at = [c.keep(16, name=f"ends_at_{name}") for name in "xyz"]
    with c.m.If(moves.valid & moves.ready):
        for axis, place in enumerate(at):
            steps = Mux(moves.p.axes[axis], moves.p.steps, 0)
            c.m.d.sync += ends_at[axis].eq(place + Mux(moves.p.direction[axis], steps, -steps))
    over = under_way & moves.ready
    c.assume(~over | c.past(c.rst) | (Cat(at) == Cat(ends_at)))
    will_be = [Mux(under_way, end, place) for end, place in zip(ends_at, at, strict=True)]

    # The order, from its taking to the clock in which it is ready again
    ordered = c.keep(1, name="ordered")
    target = [c.keep(16, name=f"ordered_{name}") for name in "xy"]
    up, down = c.keep(1, name="ordered_up"), c.keep(1, name="ordered_down")
    came = [c.keep(16, name=f"came_{name}") for name in "xyz"]
    with c.m.If(c.rst):
        c.m.d.sync += ordered.eq(0)
    with c.m.Elif(dut.ready & dut.start & ~c.signal("started")):
        c.m.d.sync += [ordered.eq(1), up.eq(order.up), down.eq(order.down), target[0].eq(order.x),
                       target[1].eq(order.y), *(was.eq(place) for was, place in
                                               zip(came, at, strict=True))]
    with c.m.Elif(dut.ready):
        c.m.d.sync += ordered.eq(0)
    far = [_distance(*pair) for pair in zip(came, target, strict=False)]
    least, low = Mux(far[0] < far[1], far[0], far[1]), came[2][-1]
    sent_z = (came[2] + Mux(up & ~down & low, dut.z_travel, 0)
              - Mux(down & ~up & ~low, dut.z_travel, 0))[:16]

    def stays(places) -> Bits:
        return (places[0] == came[0]) & (places[1] == came[1])

    def on_the_way(places) -> Bits:
        """Have gone the diagonal from where it came from."""
        return Cat(place == (was + Mux(goal > was, least, -least))[:16]
                   for place, was, goal in zip(places, came, target, strict=False)).all()

    ends = ordered & dut.ready
    refused = stays(at) & dut.error & low & (far[0] != far[1]) & (least != 0)
    c.implication("ends-at-its-target", "When it is ready again it is exactly where it was sent, "
                  "or where it came from if milling there was refused, with the tool as it was.",
                  when=ends & ~up & ~down,
                  then=(at[2] == came[2]) & ((Cat(at[:2]) == Cat(target)) | refused))
    c.implication("tool-ends-as-ordered", "When it is ready again the tool is up, or down by its "
                  "travel, as ordered, and the table where it was.", when=ends & (up | down),
                  then=stays(at) & (at[2] == sent_z))

    # What makes it so
    c.implication("target-of-present-order", "Its target is that of the present order.",
                  when=Cat(motion(name) for name in motion.codes if name not in ("REST",
                                                                                 "FAULT")).any(),
                  then=ordered & (Cat(c.signal("goal_x"), c.signal("goal_y")) == Cat(target))
                  & ((up | down) == motion("TOOL", "TOOL-WAIT"))
                  & (~motion("TOOL") | ((up ^ down) & (c.signal("raising") == up))))
    directions_known = Cat(
        (c.signal(f"steps_{name}") == _distance(place, goal))
        & (c.signal(f"ascending_{name}") == (goal > place))
        for name, place, goal in zip("xy", at, target, strict=False)).all()
    c.implication("starts-at-its-position", "Before an order moves, the position is the one it "
                  "started from, and the directions are known.",
                  when=motion("DECIDE", "TOGETHER", "DIAGONAL", "TOOL"),
                  then=stays(at) & (at[2] == came[2]) & (motion("TOOL") | directions_known)
                  & ~(motion("TOGETHER") & (far[0] != far[1]))
                  & ~(motion("DIAGONAL") & (far[0] == far[1])))
    c.implication("diagonal-first", "The diagonal takes both axes as far as the nearer goal.",
                  when=motion("DIAG-WAIT"), then=(will_be[2] == came[2]) & (far[0] != far[1])
                  & on_the_way(will_be))
    c.implication("straight-after-diagonal", "The straight rest begins where the diagonal ends.",
                  when=motion("STRAIGHT"), then=(at[2] == came[2]) & (far[0] != far[1])
                  & directions_known & on_the_way(at))
    c.implication("last-move-reaches-goal", "The last movement leads to the goal.",
                  when=motion("WAIT"),
                  then=(will_be[2] == came[2]) & (Cat(will_be[:2]) == Cat(target)))
    c.implication("tool-move-reaches-end", "A movement of the tool leads up or down, and nowhere "
                  "else.",
                  when=motion("TOOL-WAIT"), then=stays(will_be) & (will_be[2] == sent_z))
    c.implication("rest-at-goal", "At rest an order is carried out or refused, whether `ready` "
                  "shows it or not.",
                  when=ordered & motion("REST"), then=Mux(
                      up | down, stays(at) & (at[2] == sent_z),
                      (at[2] == came[2]) & ((Cat(at[:2]) == Cat(target)) | refused)))


def _distance(a: Bits, b: Bits) -> Bits:
    return Mux(a < b, b - a, a - b)[:16]
