"""Contract of the nominal speed: a product, the smaller of two, and its square, of two blocks."""

from amaranth import Cat, Mux, Value

from fresa.motion import NominalSpeed, OverrideKind

from .contract import Bits, Case, Component, Contract

__all__ = ["NOMINAL_SPEED"]

DIGITS = 8
"""Of an override."""

LOADED = 2
"""Step in which a hundredth and the override are there; their digits follow."""


def describe(c: Contract, dut: NominalSpeed) -> None:
    """What is shown is the square of the speed of the block that runs."""
    bits = dut.speed_bits
    known = c.past(~c.rst)
    limited = LOADED + DIGITS + 2
    stored = limited + bits + 1
    step, of_running, place = (c.signal(name) for name in ("step", "of_running", "place"))
    high, low, factor = (c.signal(name) for name in ("high", "low", "factor"))
    c.assume(~(dut.take & dut.load.any()))
    c.assume(~(dut.load[0] & dut.load[1]))

    clock = c.keep(7, name="clock")
    c.m.d.sync += clock.eq(clock + 1)
    c.restrict_covers((dut.load == Mux((clock == 1) | (clock == 51), 1,
                                       Mux((clock == 2) | (clock == 52), 2, 0)))
                      & (dut.take == (clock == 27)) & ~c.rst & (dut.word == 90)
                      & (dut.feed == 100) & (dut.rapid == 100) & (Value.cast(dut.override) == 0))

    # The bounds of the next block and of that which runs
    hundredth, fastest = (c.keep(dut.word_bits, name=name) for name in ("hundredth", "fastest"))
    runs_hundredth, runs_fastest = (
        c.keep(dut.word_bits, name=name) for name in ("hundredth_that_runs", "fastest_that_runs"))
    was_loaded, runs = c.keep(1, name="loaded"), c.keep(1, name="runs")
    kind = c.keep(OverrideKind, name="override_that_runs")
    c.assume(~dut.load[0] | (dut.word[bits:] == 0))
    # Of a block that is no motion the override changes without a start.
    override = Value.cast(dut.override)
    loaded = was_loaded & (c.past(dut.load[1]) | (override == c.past(override)))
    c.assume(~dut.take | (dut.ready & loaded))
    limited_first = c.keep(1, name="limited_first")
    c.assume(~dut.load[1] | limited_first)
    c.m.d.sync += was_loaded.eq(loaded)
    with c.m.If(dut.load[0]):
        c.m.d.sync += [fastest.eq(dut.word), limited_first.eq(1), was_loaded.eq(0)]
    with c.m.If(dut.load[1]):
        c.m.d.sync += [hundredth.eq(dut.word), was_loaded.eq(1)]
    with c.m.If(dut.take):
        c.m.d.sync += [runs_hundredth.eq(hundredth), runs_fastest.eq(fastest),
                       kind.eq(dut.override), runs.eq(1), was_loaded.eq(0),
                       limited_first.eq(0)]
    with c.m.If(c.rst):
        c.m.d.sync += [was_loaded.eq(0), runs.eq(0), limited_first.eq(0)]
    mine: Bits = Mux(of_running, Value.cast(kind), Value.cast(dut.override))
    percent = Mux(mine == OverrideKind.RAPID, dut.rapid,
                  Mux(mine == OverrideKind.NONE, 100, dut.feed))
    concerns = Mux(of_running, runs, loaded)
    of_it, bound = (Mux(of_running, *each) for each in (
        (runs_hundredth, hundredth), (runs_fastest, fastest)))
    words = c.words("bounds")
    c.invariant("bounds", "The memory has the bounds of both blocks.", Cat(
        ~loaded | (_of(words, place, 1) == hundredth),
        ~limited_first | (_of(words, place, 0) == fastest), ~loaded | limited_first,
        ~runs | (_of(words, ~place, 1) == runs_hundredth),
        ~runs | (_of(words, ~place, 0) == runs_fastest),
        ~runs | (Value.cast(c.signal("running")) == Value.cast(kind))).all(),
        cover=loaded & runs, lemma=True)

    # What is computed
    # Products as sums: a solver does not multiply.
    product, square = (c.keep(dut.word_bits + bits, name=name) for name in ("product", "square"))
    speed = product >> DIGITS
    least = Mux(speed < bound, speed, bound)[:bits]
    c.invariant("steps", "Steps are counted.", step <= stored, cover=step == stored, lemma=True)
    c.invariant("reads", "What is read is there in time.", Cat(
        ~concerns | (step != LOADED) | (c.signal("bound") == of_it),
        ~concerns | (step <= LOADED) | (step > limited) | (step == LOADED + 1)
        | (c.signal("bound") == bound)).all(), cover=step == LOADED, lemma=True)
    fetched = c.part("bounds").read_ports[0].data
    c.invariant("fetches", "It is read before.", Cat(
        ~concerns | (step != LOADED - 1) | (fetched == of_it),
        ~concerns | (step < LOADED) | (step >= limited) | (fetched == bound)).all(),
        cover=step == LOADED, lemma=True)
    for name, begin, count, first, multiplier, total in (
            ("override", LOADED + 1, DIGITS, of_it, percent, product),
            ("square", limited + 1, bits, least, least, square)):
        rest, weighted = (c.keep(len(each), name=f"{name}_{part}") for each, part in (
            (multiplier, "rest"), (total, "weighted")))
        with c.m.If(step == begin - 1):
            c.m.d.sync += [total.eq(0), rest.eq(multiplier), weighted.eq(first)]
        with c.m.Elif((step >= begin) & (step < begin + count)):
            c.m.d.sync += [total.eq(total + Mux(rest[0], weighted, 0)), rest.eq(rest >> 1),
                           weighted.eq(weighted << 1)]
        c.implication(f"{name}-digit-by-digit", "Digits are multiplied one after the other.",
                      when=(step >= begin) & (step <= begin + count) & concerns,
                      then=(factor == first) & Cat(
                          (step != begin + done)
                          | (Cat(low, high) == (total << bits - done | rest))
                          & (weighted == Value.cast(first) << done) & (rest >> count - done == 0)
                          for done in range(count + 1)).all(), lemma=True)
    c.implication("slower", "It is known which of the two is the smaller one.",
                  when=(step == limited) & concerns,
                  then=(c.signal("slower") == (speed < bound)) & (high == speed), lemma=True)
    squares = square[:2 * bits]
    stores = (step == stored) & concerns
    c.implication("squares", "The smaller of feed x override and limit is squared.", when=stores,
                  then=Cat(low, high)[:2 * bits] == squares)
    c.implication("is-of-the-block", "What is shown of a block is its own square.",
                  when=known & c.past(stores & of_running & ~dut.take & ~dut.load[1]),
                  then=dut.nominal == c.past(squares))
    following = c.keep(2 * bits, name="square_of_next")
    with c.m.If(stores & ~of_running):
        c.m.d.sync += following.eq(squares)
    c.implication("next-is-known", "The next is ready when it was squared after it was loaded.",
                  when=dut.ready & loaded, then=c.signal("following") == following)
    c.implication("ready-stays", "It stays ready until another is loaded.",
                  when=known & c.past(dut.ready & ~dut.load[1]), then=dut.ready)
    c.implication("not-ready-behind-reset", "Behind a reset it is not ready.", when=~known,
                  then=~dut.ready)
    c.implication("next-is-shown", "It is shown from the clock after it was taken.",
                  when=known & c.past(dut.take), then=dut.nominal == c.past(following))
    c.implication("nothing-else", "Nothing else changes what is shown.",
                  when=known & (dut.nominal != c.past(dut.nominal)),
                  then=c.past(dut.take | (step >= stored) & of_running))
    age = c.keep(range(bits + 32), name="clocks_since_load")
    c.m.d.sync += age.eq(Mux(dut.load[1] | c.rst, 0, age + (age != bits + 15)))
    c.implication("ready-in-time", "The next is ready in time.",
                  when=loaded & (age == bits + 15), then=dut.ready)
    c.invariant("age", "Clocks since it was loaded are those of its steps.",
                ~loaded | dut.ready | (~of_running & (step == age)), cover=loaded & (age == 9),
                lemma=True)


def _of(words: list, place: Bits, which: int) -> Bits:
    return Mux(place, words[2 + which], words[which])


NOMINAL_SPEED = Component(
    make=NominalSpeed, describe=describe, depth=56,
    cases=(Case({"speed_bits": 8, "word_bits": 8}), Case(real=True)))
