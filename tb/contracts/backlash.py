"""Contract of the backlash of gears: a motor and its load, with steps in between."""

from amaranth import Mux, signed

from fresa.motion import Backlash

from .contract import Case, Component, Contract

__all__ = ["BACKLASH"]


def describe(c: Contract, dut: Backlash) -> None:
    """With constant backlash, the difference of motor and load never exceeds it."""
    up, down = dut.moved & dut.direction, dut.moved & ~dut.direction
    first = c.keep(dut.backlash.shape(), name="first_backlash")
    steady = c.keep(1, init=1, name="steady")  # the backlash was never another before this clock
    is_steady = steady & ((dut.backlash == first) | ~c.past(1))
    c.m.d.sync += [first.eq(dut.backlash), steady.eq(is_steady)]

    # How far the motor is above the load
    gap = c.keep(signed(len(dut.backlash) + 2), name="gap")
    c.m.d.sync += gap.eq(gap + (up & ~dut.counted) - (down & ~dut.counted))
    way, left = c.signal("way"), c.signal("left")
    c.implication("within-the-backlash",
                  "Motor and load are never further apart than the backlash.",
                  when=is_steady, then=(gap >= 0) & (gap <= dut.backlash))
    c.implication("counts-only-engaged", "A step counts only where the motor pushes: at the end "
                  "of the backlash.", when=is_steady & dut.counted,
                  then=gap == Mux(dut.direction, dut.backlash, 0))
    c.implication("backlash-is-taken-up",
                  "A step does not count only where there is backlash to take up.",
                  when=is_steady & dut.moved & ~dut.counted,
                  then=gap != Mux(dut.direction, dut.backlash, 0))
    c.implication("gap-is-remaining", "What is left to take up is what is missing to the end of "
                  "the backlash.", when=is_steady,
                  then=(left <= dut.backlash) & (gap == Mux(way, dut.backlash - left, left)))

    c.implication("counts-only-made-steps", "What is not made is not counted.",
                  when=~dut.moved, then=~dut.counted)
    last, pushed = c.keep(1, name="last"), c.keep(1, init=1, name="pushed")
    most, taken = c.keep(dut.backlash.shape(), name="most"), c.keep(len(dut.backlash) + 1,
                                                                    name="taken")
    turns = dut.direction != last
    with c.m.If(dut.moved):
        c.m.d.sync += [last.eq(dut.direction), pushed.eq(dut.counted),
                       most.eq(Mux(turns, dut.backlash, most)),
                       taken.eq(Mux(turns, 0, taken) + ~dut.counted)]
    c.implication("counts-until-reversal", "After a step that counts, the next in its direction "
                  "counts, whatever becomes of the backlash.",
                  when=dut.moved & pushed & ~turns, then=dut.counted)
    c.implication("no-more-than-the-backlash", "After a reversal no more steps are left out than "
                  "there was backlash.", when=dut.moved & ~dut.counted,
                  then=Mux(turns, 0, taken) < Mux( turns, dut.backlash, most))
    c.invariant("gap-at-most-that-of-reversal", "What is left to take up is no more than the "
                "backlash at the reversal, less what is taken up.",
                (way == last) & (left + taken <= most) & (~pushed | (left == 0)), cover=left != 0)


BACKLASH = Component(
    make=Backlash, describe=describe, depth=10,
    cases=(Case({"max_backlash": 3}), Case({"max_backlash": 2}), Case({"max_backlash": 1023},
                                                                      real=True)))
