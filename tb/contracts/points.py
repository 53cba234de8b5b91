"""Contract of the store of points: one of them, any, is watched."""

from amaranth import Cat, Const

from fresa.motion import PointStore, points

from .contract import Bug, Case, Component, Contract

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

    c.always("knows-what-there-is", "A point is there from the clock after it was stored, until "
             "reset, and no other is.", dut.stored == known, seen=dut.stored,
             bug=(Bug(points, "there.bit_select(self.number, 1).eq(1)", "there.eq(~0)"),
                  Bug(points, "there = Signal(1 << len(self.number))",
                      "there = Signal(1 << len(self.number), reset_less=True)")))
    c.holds("found", "A point that is there is found, a clock after its number.",
            when=c.past(known), then=Cat(dut.found) == c.past(place),
            bug=(Bug(points, "write.data.eq(Cat(self.place))",
                     "write.data.eq(Cat(*self.place[1:], self.place[0]))"),
                 Bug(points, "read.addr.eq(self.number)", "read.addr.eq(1)")))
    c.holds("no-such-point", "There is no point 0, and none above the last.", when=~exists,
            then=~dut.stored, bug=Bug(points, "self.store & exists", "self.store"))

    words = c.words("places")
    flags = c.signal("there")
    c.always("stored", "The memory holds the points that are there, and the flags say which.",
             Cat((flags[number] == has) & (~has | (words[number] == at))
                 for number, (has, at) in enumerate(zip(there, places, strict=True), 1)).all()
             & ~flags[0] & ~flags[dut.points + 1:].any(), seen=there[-1],
             bug=Bug(points, "write.addr.eq(self.number)", "write.addr.eq(self.number ^ 1)"))


POINTS = Component(
    make=PointStore, describe=describe, depth=6,
    cases=(Case({"points": 2, "axes": 2, "width": 2}), Case({"points": 1, "axes": 1, "width": 2}),
           Case({"points": 7, "axes": 3, "width": 32}, real=True)))
