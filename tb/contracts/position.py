"""Contract of moving to a position."""

from amaranth import Mux, signed

from fresa.motion import MoveTo

from .contract import Case, Component, Contract

__all__ = ["POSITION"]


def describe(c: Contract, dut: MoveTo) -> None:
    """The position is that of the steps made, and each leads towards the target of its clock."""
    c.assume(~dut.moved | dut.step)  # a driver makes what is requested
    target = (~dut.target_n).as_signed()
    was, sent = c.past(dut.position), c.past(target)
    moved, up = c.past(dut.moved & ~c.rst), c.past(dut.direction)

    # Two bits more than a position has: here nothing could wrap unseen.
    place = c.keep(signed(dut.width + 2), name="place")
    with c.m.If(c.rst):
        c.m.d.sync += place.eq(0)
    with c.m.Elif(dut.load):
        c.m.d.sync += place.eq(dut.place)
    with c.m.Elif(dut.moved):
        c.m.d.sync += place.eq(place + Mux(dut.direction, 1, -1))
    c.invariant("no-lost-step", "The position is that of the last reset or load, and the steps "
                "made since, up less down.", dut.position == place, cover=moved)
    c.implication("nearer", "Each step leads one nearer to the target that was given in its clock.",
                  when=moved, then=Mux(up, (sent > was) & (dut.position == was + 1),
                                       (sent < was) & (dut.position == was - 1)))
    c.implication("never-wraps", "A step up makes the position more, a step down less: it never "
                  "wraps.", when=moved, then=Mux(up, dut.position > was, dut.position < was))
    c.invariant("direction",
                "The direction is that of the target, also where no step is requested; at the "
                "target it is up.", dut.direction == (target >= dut.position), cover=dut.direction)
    c.invariant("in-position", "`in_position` is 1 where the position is the target, and only "
                "there.", dut.in_position == (dut.position == target), cover=dut.in_position)
    c.implication("requests-until-target", "Until it is at the target a step is requested.",
                  when=dut.run & ~dut.load & (dut.position != target), then=dut.step)
    c.implication("no-request-at-target",
                  "At the target, in a load and without `run` no step is requested.",
                  when=~dut.run | dut.load | (dut.position == target), then=~dut.step)
    c.implication("reset-is-0", "After a reset the position is 0.",
                  when=c.past(c.rst), then=dut.position == 0)


POSITION = Component(
    make=MoveTo, describe=describe, depth=6,
    cases=(Case({"width": 3}), Case({"width": 2}), Case({"width": 32}, real=True)))
