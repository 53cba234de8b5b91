"""Contract of the rotator: each addition is the exact one, and nothing overflows."""

from amaranth import Cat, Const, Mux

from fresa.motion import Rotator

from .contract import Case, Component, Contract

__all__ = ["ROTATOR"]


def describe(c: Contract, dut: Rotator) -> None:
    """That a chain of half turns is a circle is not proved: that is tested."""
    c.assume(~dut.load | (dut.ready & ~dut.turn))
    c.assume((dut.shift >= 4) & (dut.shift <= 30))
    source, target = c.signal("source"), c.signal("target")
    amount, adding = c.signal("amount"), c.signal("adding")
    is_x = c.signal("source_is_x")
    loaded, turns = c.past(dut.load), c.past(dut.turn & dut.ready)
    known = c.keep(1, name="loaded_once")
    with c.m.If(dut.load):
        c.m.d.sync += known.eq(1)

    c.implication("two-clocks", "A half turn takes two clocks: in the second one no other begins.",
                  when=c.past(1), then=dut.ready == ~turns)
    c.invariant("one-at-a-time", "A half turn that begins moves u or v, and only then.",
                (dut.moves_u ^ dut.moves_v) == (dut.turn & dut.ready), cover=dut.moves_u)
    last_v = c.keep(1, name="last_moved_v")
    with c.m.If(dut.load | dut.moves_u | dut.moves_v):
        c.m.d.sync += last_v.eq(~dut.load & dut.moves_v)
    c.implication("in-turn", "The first half turn moves v, the next one u, and so on.",
                  when=known & (dut.moves_u | dut.moves_v), then=dut.moves_v == ~last_v)
    c.implication("next-is-the-other", "The shifter is at the one that moves next.",
                  when=known, then=is_x == (~last_v ^ adding), lemma=True)

    zeros = dut.width - dut.precision
    y = c.past(dut.y << zeros)
    c.implication("load", "A load begins with its vector, mirrored if asked for.", when=loaded,
                  then=(dut.vector == c.past(dut.x << zeros))
                  & (target == Mux(c.past(dut.mirror), -1 - y, y)))

    shift = c.keep(5, name="loaded_shift")
    first = c.keep(1, name="is_first")
    with c.m.If(dut.load):
        c.m.d.sync += [shift.eq(dut.shift), first.eq(1)]
    with c.m.Elif(adding):
        c.m.d.sync += first.eq(0)
    c.implication("half-at-first", "The first addition after a load is half as large.", when=known,
                  then=(amount == shift + first) & (shift >= 4) & (shift <= 30)
                  & (c.signal("first") == first))

    # Sums with bits to spare; |x| and |y| to 1.01 * 2**(width - 2)
    bound = (101 << dut.width - 2) // 100
    bounded = (source <= bound) & (source >= -bound) & (target <= bound) & (target >= -bound)
    part = ((source << 1 >> amount) + 1) >> 1
    exact = c.past(target + Mux(is_x, part, -part))
    c.implication("exact", "Each addition is that of the other component over 2**m, rounded to "
                  "nearest, and fits, from vectors within their bounds.",
                  when=known & c.past(adding & bounded) & c.past(known),
                  then=(source == exact) & (target == c.past(source)))
    even = Cat(Const(0, 1), amount[1:])
    c.implication("shifted", "What is added is the shifted one, but for the lowest bit of the "
                  "amount.", when=known & adding,
                  then=c.signal("shifted").as_signed() == Mux(
                      is_x, source << 1 >> even, ~(source << 1 >> even)), lemma=True)
    c.implication("rests", "Without a turn or a load nothing changes.",
                  when=c.past(dut.ready & ~dut.load), then=(source == c.past(source))
                  & (target == c.past(target)))


ROTATOR = Component(
    make=Rotator, describe=describe, depth=8,
    cases=(Case({"width": 8, "precision": 6}), Case({"width": 12, "precision": 12}),
           Case({}, real=True)))
