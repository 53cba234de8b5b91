"""Contract of the converter of units: every value once, and to its nearest."""

from amaranth import Cat, Const, Mux, Value

from fresa.protocol import GCodeUnit, UnitConverter
from fresa.protocol.gcode_modes import LETTERS

from .contract import Bits, Case, Component, Contract

__all__ = ["UNIT_CONVERTER"]

SMALL = 8
"""Largest width at which values are stated."""


def describe(c: Contract, dut: UnitConverter) -> None:
    """Lengths in inches and feeds are converted, each once, and nothing else; lists divide."""
    line = dut.line
    over = dut.done | dut.too_long
    goes_on = c.past(dut.run & ~over & ~c.rst)
    c.assume(~goes_on | (dut.run & (Value.cast(line) == c.past(Value.cast(line)))
                         & (dut.was_inverse == c.past(dut.was_inverse))))
    c.assume(dut.run | c.past(~dut.run | over | c.rst, init=1))
    asks = c.past(dut.divide & ~c.rst)
    division = Value.cast(dut.division)
    c.assume(~(dut.run & dut.divide))
    c.assume(~c.past(dut.divide & ~dut.divided & ~c.rst) | dut.divide)
    c.assume(~asks | ~dut.divide | (division == c.past(division)))
    if not c.upset:
        c.restrict_covers(~c.rst)
    state, letter = c.state("converter_state"), c.signal("letter")
    minutes, lists = c.signal("minutes"), c.signal("lists")
    feed = letter == LETTERS.index("F")
    lengths, centres = (Cat(Const(name in which) for name in LETTERS)
                        for which in ("IJKRXYZ", "IJK"))
    wanted = line.letters & Mux(line.modes.inches, lengths, 0) | (
        line.letters[0] & ~line.modes.inverse)
    stores = state("STORE")
    last = stores & (~feed | minutes)

    converted = c.keep(len(LETTERS), name="converted")
    with c.m.If(last):
        c.m.d.sync += converted.bit_select(letter, 1).eq(1)
    with c.m.If(c.rst | over):
        c.m.d.sync += converted.eq(0)
    c.implication("each-once", "At the end each feed, and each length in inches, was converted, "
                  "and nothing else.", when=dut.done, then=converted == wanted)
    c.invariant("in-order", "They are converted in order.",
                (letter <= len(LETTERS))
                & (converted == (wanted & ((Const(1, 16) << letter) - 1)[:len(LETTERS)]))
                & (~dut.run | state("SELECT") | lists | wanted.bit_select(letter, 1))
                & (dut.run | ((state("SELECT", "FAULT") | lists) & (letter == 0) & ~minutes))
                & (~lists | ((letter == 0) & ~minutes & ~state("LIMIT", "STORE")))
                & (~minutes | feed), cover=converted == 2, lemma=True)
    c.implication("centre", "A centre that is not given is 0.", when=dut.write & ~stores,
                  then=(dut.data == 0)
                  & (centres & ~line.letters).bit_select(dut.address, 1))

    c.implication("stores-where-it-was", "A value is stored where it was.", when=stores,
                  then=dut.write & (dut.address == letter))
    added, carry = c.signal("added"), c.signal("carry")
    c.invariant("clears", "The number is made 0 unless something else is done.",
                state("DIVIDE", "ROUND") | state.is_unused()
                | ((added == 3) & (carry | state("LIMIT", "LISTED")) & ~(carry & state("LIMIT"))),
                cover=state("LIMIT"), lemma=True)
    c.invariant("divides-for-a-list", "Only what is asked for is divided for a list.",
                (~dut.divided | lists)
                & (~lists | dut.divide | state("SELECT", "LISTED", "FAULT") | state.is_unused()),
                cover=lists, lemma=True)
    c.implication("quotient-stays", "A quotient stays as long as it is asked for.",
                  when=asks & c.past(dut.divided),
                  then=dut.divided & (dut.data == c.past(dut.data)))
    released = c.past(dut.divided & ~dut.divide & ~c.rst)
    c.implication("no-quotient", "Two clocks after it was used it is 0.",
                  when=c.past(released & ~c.rst), then=dut.data == 0)
    if dut.width <= SMALL:
        _values(c, dut, state, feed)
    c.leaves_unused_codes("converter_state", fault=dut.fault,
                          shows=~dut.write & ~dut.done & ~dut.too_long & ~dut.divided)


def _values(c: Contract, dut: UnitConverter, state, feed: Bits) -> None:
    """State what a value becomes, and what a word is in a list."""
    minutes, lists, number = c.signal("minutes"), c.signal("lists"), c.signal("number")
    rest, count, stores = c.signal("rest"), c.signal("count"), state("STORE")
    bits, ends = len(number), 1 << len(count)
    source = c.keep(dut.width, name="source")  # its magnitude
    minus = c.keep(1, name="minus")
    with c.m.If(state("SIGN")):
        c.m.d.sync += [source.eq(Mux(dut.word < 0, -dut.word, dut.word)), minus.eq(dut.word < 0)]
    c.assume(~c.past(state("SIGN", "DIVIDE") & ~c.rst) | (dut.word == c.past(dut.word)))
    too_much = c.keep(1, name="too_much")  # a feed in inches was
    beyond, rounds, fits = c.signal("beyond"), state("ROUND"), ~rest[-1]
    quotient = c.keep(bits + 1, name="quotient")
    with c.m.If(stores):
        c.m.d.sync += too_much.eq(feed & ~minutes & beyond)
    with c.m.If(c.rst):
        c.m.d.sync += too_much.eq(0)
    with c.m.If(rounds):
        c.m.d.sync += quotient.eq(Cat(fits, number ^ minus.replicate(bits)))
    nearest = Mux(lists, dut.division.nearest, ~minutes)
    c.assume(~state("SIGN") | (dut.word >= 0) | Mux(lists, nearest, ~feed))
    unit, inches = dut.division.unit, dut.division.inches
    divisor: Bits = Mux(lists, Mux(
        unit == GCodeUnit.LENGTH, Mux(inches, 2540, 1000), Mux(
            unit == GCodeUnit.FEED, Mux(inches, 127_000, 50_000), Mux(
                (unit == GCodeUnit.INVERSE) & inches, 100_000, 1_000_000))),
        Mux(minutes, 60, 5))
    thrice = lists & (unit == GCodeUnit.FEED)
    once = (lists | minutes) & ~thrice
    dividend: Bits = Mux(once, source, Mux(thrice, source * 3, (source << 7) - source))[:bits - 1]
    size = Mux(dut.data < 0, -dut.data, dut.data)

    def times(factor: Bits) -> Bits:
        """Return a number times the divisor, as a choice of products with constants."""
        product = Const(0)
        for each in (1000, 2540, 50_000, 127_000, 100_000, 1_000_000, 60, 5):
            product = product | Mux(divisor == each, factor * each, 0)
        return product

    product = times(size)
    lengths = ~lists & ~minutes
    c.implication("sign", "A value keeps its sign.",
                  when=(stores & ~beyond) | (dut.divided & dut.divide),
                  then=(dut.data == 0) | ((dut.data < 0) == minus))
    c.implication("length", "A length, or a feed in inches, is 25.4 of it, to the nearest, unless "
                  "it is too long.", when=stores & lengths & ~beyond,
                  then=(product <= dividend + 2) & (dividend + 2 < product + 5))
    top = (1 << dut.speed) - 1
    c.implication("feed", "A feed is a 60th of it, towards zero, from 1 to the highest, or 0; it "
                  "is the highest if it was too long in inches.",
                  when=stores & minutes, then=Mux(too_much, dut.data == top, Mux(
                      source == 0, size == 0, Mux(
                          source < 60, size == 1, Mux(source >= 60 * (top + 1), size == top,
                          (product <= source) & (source < product + 60))))))
    c.implication("too-long", "A length beyond reach is refused, and no other value.",
                  when=stores, then=dut.too_long == (
                      ~feed & (dividend + 2 >= (5 << dut.reach - 1))))
    c.implication("nearest", "A word is divided to the nearest, half away from zero.",
                  when=dut.divided & dut.divide & nearest,
                  then=(2 * product <= 2 * dividend + divisor)
                  & (2 * dividend < 2 * product + divisor))
    c.implication("towards-0", "Or towards 0.", when=dut.divided & dut.divide & ~nearest,
                  then=(product <= dividend) & (dividend < product + divisor))

    # In the loop, after so many doublings
    twice = (dividend << 1)[:bits]
    loads: Bits = Mux(once, 1, Mux(thrice, 2, 7))
    loading = state("DIVIDE") & (count >= ends - 8)
    loaded = (count - (ends - loads))[:3]
    working = (state("DIVIDE") & (count < ends - 8)) | rounds
    turns = (count - 1)[:len(count)]
    low = ((Const(1, bits + 1) << turns) - 1)[:bits]
    digits = (number ^ minus.replicate(bits)) & low
    before = (twice >> (bits - turns)[:len(count)])[:bits]
    found = Cat(fits, digits)
    left = (rest.as_signed() + Mux(fits, 0, divisor))
    added, carry, least = c.signal("added"), c.signal("carry"), c.signal("least")
    c.invariant("loads", "A word is added without its sign, once, or so that it counts 3 or 127 "
                "times.", (~loading | (
                    (count >= ends - loads) & (number == ((source << loaded) - source)[:bits])
                    & (added == Mux(minus, 2, 1)) & (carry == minus)))
                & (~state("SIGN") | (number == 0)) & (~loading | (rest == 0)),
                cover=loading, lemma=True)
    c.invariant("division", "A bit of the quotient replaces one of the dividend, a clock after "
                "it was found.", (~working | (count == 0) | (
                    (count <= bits + 1) & ((number & ~low) == ((twice << turns) & ~low)[:bits])
                    & (left >= 0) & (left < divisor)
                    & (before == times(found) + left)))
                & (~working | (count != 0) | ((number == dividend) & (rest == 0)))
                & (~working | ((added == 0) & (c.signal("divides") == (count != 0))))
                & (rounds | (least == 0)) & (rounds | ~working | (carry == 0))
                & (~rounds | (count == bits + 1)) & (~state("DIVIDE") | (count != bits + 1)),
                cover=rounds, lemma=True)
    c.invariant("digits", "Of the quotient it is known whether it is 0, and of the dividend.",
                (~working | (count == 0) | (
                    (c.signal("some") == digits.any()) & (c.signal("was_some") == before.any())))
                & (~rounds | ((least == (minutes & source.any() & ~digits.any()))
                              & (carry == (nearest | least)))),
                cover=rounds & least, lemma=True)
    reach = Mux(minutes, dut.speed, Mux(feed, dut.width - 1, dut.reach - 1))
    sampled = working & (count > bits + 1 - reach)
    c.invariant("beyond", "It is known whether it is too long.",
                lists | (state("SELECT", "FAULT") & ~minutes) | state("STORE") | state.is_unused()
                | (beyond == (too_much | Mux(
                    state("LIMIT"), (quotient >> (reach + 1)).any(),
                    sampled & (digits >> (count + reach - bits - 1)[:5]).any()))),
                cover=beyond & working, lemma=True)
    c.invariant("too-much", "A feed in inches that was is one in minutes.",
                ~too_much | (minutes & ~lists), cover=minutes, lemma=True)
    rounded = Mux(minutes & (quotient[1:] == 0) & source.any(), 2,
                  (quotient ^ minus.replicate(bits + 1)) + nearest)[:bits]
    over = state("LIMIT", "STORE") | (state("LISTED") & dut.divide)
    c.invariant("rounded", "What is stored, or listed, is the quotient.",
                ~over | ((times(quotient) <= twice) & (twice < times(quotient) + divisor)
                         & (number == Mux(state("STORE") & minutes & beyond,
                                          (2 << dut.speed) - 1, rounded))
                         & (lists | state("LIMIT") | (beyond == (
                             too_much | (quotient >> (reach + 1)).any())))),
                cover=stores, lemma=True)
    c.invariant("signs", "The sign that is known is that of the word.",
                state("SELECT", "FETCH", "SIGN", "FAULT") | state.is_unused() | (
                    (c.signal("negative") == minus) & (source <= 1 << dut.width - 1)
                    & (source.any() | ~minus) & (nearest | ~minus | state("LISTED"))),
                cover=minus, lemma=True)


UNIT_CONVERTER = Component(
    make=UnitConverter, describe=describe, depth=34,
    cases=(Case({"width": 8, "reach": 6, "speed": 2}), Case(real=True),
           Case({"width": 8, "reach": 6, "speed": 2}, upset=True)))
