"""Contract of the store of points: one of them, any, is watched."""

from amaranth import Cat, Const

from fresa.motion import PointStore

from .contract import Case, Component, Contract

__all__ = ["POINTS"]


def describe(c: Contract, dut: PointStore) -> None:
    """What is stored is found again, until it is stored anew; what is not is known not to be."""
    exists = (dut.number != 0) & (dut.number <= dut.points)
    there = [c.keep(1, name=f"has_{number}") for number in range(1, dut.points + 1)]
    places = [c.keep(dut.axes * dut.width, name=f"at_{number}")
              for number in range(1, dut.points + 1)]
    known, place = Const(0), Const(0, dut.axes * dut.width)
    for number, (has, at) in enumerate(zip(there, places, strict=True), 1):
        with c.m.If(dut.store & (dut.number == number)):
            c.m.d.sync += [has.eq(1), at.eq(Cat(dut.place))]
        with c.m.If(c.rst):
            c.m.d.sync += has.eq(0)
        known = known | (dut.number == number) & has
        place = place | at & (dut.number == number).replicate(len(at))

    c.invariant("valid-once-stored", "A point is valid from the clock after it was stored, until "
                "reset, and no other is.", dut.stored == known, cover=dut.stored)
    c.implication("found", "A valid point is found, a clock after its number.",
                  when=c.past(known), then=Cat(dut.found) == c.past(place))
    c.implication("no-such-point", "There is no point 0, and none above the last.", when=~exists,
                  then=~dut.stored)

    words = c.words("places")
    flags = c.signal("written")
    c.invariant("stored", "The memory holds the valid points, and the flags mark them.",
                Cat((flags[number] == has) & (~has | (words[number] == at))
                    for number, (has, at) in enumerate(zip(there, places, strict=True), 1)).all()
                & ~flags[0] & ~flags[dut.points + 1:].any(), cover=there[-1])


POINTS = Component(
    make=PointStore, describe=describe, depth=6,
    cases=(Case({"points": 2, "axes": 2, "width": 2}), Case({"points": 1, "axes": 1, "width": 2}),
           Case({"points": 7, "axes": 3, "width": 32}, real=True)))
