"""Contract of the play of gears: what a motor and its load do, with steps in between."""

from amaranth import Mux, signed

from fresa.motion import Backlash, backlash

from .contract import Bug, Case, Component, Contract

__all__ = ["BACKLASH"]


def describe(c: Contract, dut: Backlash) -> None:
    """While the play is what it is, motor and load are never further apart than that."""
    up, down = dut.moved & dut.direction, dut.moved & ~dut.direction
    first = c.keep(dut.play.shape(), name="first_play")
    steady = c.keep(1, init=1, name="steady")  # the play was never another before this clock
    is_steady = steady & ((dut.play == first) | ~c.past(1))
    c.m.d.sync += [first.eq(dut.play), steady.eq(is_steady)]

    # How far the motor is above the load
    gap = c.keep(signed(len(dut.play) + 2), name="gap")
    c.m.d.sync += gap.eq(gap + (up & ~dut.counted) - (down & ~dut.counted))
    way, left = c.signal("way"), c.signal("left")
    c.holds("within-the-play", "Motor and load are never further apart than the play.",
            when=is_steady, then=(gap >= 0) & (gap <= dut.play),
            bug=(Bug(backlash, "self.play - left", "self.play"),
                 Bug(backlash, "way = Signal(reset_less=True)", "way = Signal()")))
    c.holds("load-is-pushed", "A step counts only where the motor pushes: at the end of the play.",
            when=is_steady & dut.counted, then=gap == Mux(dut.direction, dut.play, 0),
            bug=(Bug(backlash, "ahead == 0)),\n        ]", "ahead <= 1)),\n        ]"),
                 Bug(backlash, "left = Signal.like(self.play, reset_less=True)",
                     "left = Signal.like(self.play)")))
    c.holds("play-is-taken-up", "A step does not count only where there is play to take up.",
            when=is_steady & dut.moved & ~dut.counted,
            then=gap != Mux(dut.direction, dut.play, 0),
            bug=Bug(backlash, "ahead - 1", "ahead"))
    c.holds("gap-is-left", "What is left to take up is what is missing to the end of the play.",
            when=is_steady, then=(left <= dut.play) & (gap == Mux(way, dut.play - left, left)),
            bug=Bug(backlash, "way.eq(self.direction)", "way.eq(self.direction & way)"))

    c.holds("counts-what-is-made", "What is not made is not counted.",
            when=~dut.moved, then=~dut.counted,
            bug=Bug(backlash, "self.moved & (ahead == 0)", "ahead == 0"))
    last, pushed = c.keep(1, name="last"), c.keep(1, init=1, name="pushed")
    most, taken = c.keep(dut.play.shape(), name="most"), c.keep(len(dut.play) + 1, name="taken")
    turns = dut.direction != last
    with c.m.If(dut.moved):
        c.m.d.sync += [last.eq(dut.direction), pushed.eq(dut.counted),
                       most.eq(Mux(turns, dut.play, most)),
                       taken.eq(Mux(turns, 0, taken) + ~dut.counted)]
    c.holds("goes-on-pushing", "After a step that counts, the next that way does, whatever becomes "
            "of the play.", when=dut.moved & pushed & ~turns, then=dut.counted,
            bug=Bug(backlash, "self.direction == way, left, back",
                    "self.direction == way, left ^ (self.play == 0), back"))
    c.holds("no-more-than-the-play", "After a reversal no more steps are left out than there was "
            "play.", when=dut.moved & ~dut.counted, then=Mux(turns, 0, taken) < Mux(
                turns, dut.play, most),
            bug=Bug(backlash, "Mux(left > self.play, 0, self.play - left)", "self.play - left"))
    c.always("remembers", "What is left to take up is no more than the play at the reversal, less "
             "what is taken up.", (way == last) & (left + taken <= most)
             & (~pushed | (left == 0)), seen=left != 0,
             bug=Bug(backlash, "with m.If(self.moved):", "with m.If(1):"))


BACKLASH = Component(
    make=Backlash, describe=describe, depth=10,
    cases=(Case({"max_play": 3}), Case({"max_play": 2}), Case({"max_play": 1023}, real=True)))
