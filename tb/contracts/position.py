"""Contract of moving to a position."""

from amaranth import Mux, signed

from fresa.motion import MoveTo, position

from .contract import Bug, Case, Component, Contract

__all__ = ["POSITION"]

ASKS = "self.run & ~self.load & (self.position != self.target)"


def describe(c: Contract, dut: MoveTo) -> None:
    """The position is that of the steps made, and each leads towards the target of its clock."""
    c.assume(~dut.moved | dut.step)  # a driver makes what is asked of it
    was, sent = c.past(dut.position), c.past(dut.target)
    moved, up = c.past(dut.moved & ~c.rst), c.past(dut.direction)

    # Two bits more than a position has: here nothing could wrap unseen.
    place = c.keep(signed(dut.width + 2), name="place")
    with c.m.If(c.rst):
        c.m.d.sync += place.eq(0)
    with c.m.Elif(dut.load):
        c.m.d.sync += place.eq(dut.place)
    with c.m.Elif(dut.moved):
        c.m.d.sync += place.eq(place + Mux(dut.direction, 1, -1))
    c.always("no-lost-step", "The position is that of the last reset or load, and the steps made "
             "since, up less down, for ever.", dut.position == place, seen=moved,
             bug=(Bug(position, "with m.Elif(self.moved)",
                      "with m.Elif(self.moved & self.target[0])"),
                  Bug(position, "self.position.eq(self.place)", "self.position.eq(0)"),
                  Bug(position, "with m.If(self.load):", "with m.If(self.load & self.run):")))
    c.holds("nearer", "Each step leads one nearer to the target that was given in its clock.",
            when=moved, then=Mux(up, (sent > was) & (dut.position == was + 1),
                                 (sent < was) & (dut.position == was - 1)),
            bug=(Bug(position, "self.position < self.target", "self.position <= self.target + 1"),
                 Bug(position, "Mux(below, 1, -1)", "Mux(below, 2, -1)")))
    c.holds("never-wraps", "A step up makes the position more, a step down less: it never wraps.",
            when=moved, then=Mux(up, dut.position > was, dut.position < was),
            bug=Bug(position, "self.position < self.target",
                    "(self.target - self.position)[:self.width].as_signed() > 0"))
    c.always("direction", "The direction is that of the target, also where no step is asked for.",
             dut.direction == (dut.target > dut.position), seen=dut.direction,
             bug=Bug(position, "self.position < self.target", "self.position <= self.target"))
    c.holds("asks", "Until it is at the target it asks for a step.",
            when=dut.run & ~dut.load & (dut.position != dut.target), then=dut.step,
            bug=Bug(position, "self.position != self.target", "self.position < self.target"))
    c.holds("asks-for-no-more", "At the target, in a load and without `run` it asks for none.",
            when=~dut.run | dut.load | (dut.position == dut.target), then=~dut.step,
            bug=tuple(Bug(position, ASKS, ASKS.replace(part, "")) for part in (
                "self.run & ", "~self.load & ", " & (self.position != self.target)")))
    c.holds("reset-is-0", "After a reset this place is 0, whatever was loaded or made.",
            when=c.past(c.rst), then=dut.position == 0,
            bug=Bug(position, "below = Signal()",
                    "below = Signal(); self.position._reset_less = True"))


POSITION = Component(
    make=MoveTo, describe=describe, depth=6,
    cases=(Case({"width": 3}), Case({"width": 2}), Case({"width": 32}, real=True)))
