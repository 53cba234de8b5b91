"""Contract of the converter of units: every value once, and to its nearest."""

from amaranth import Cat, Const, Mux, Value

from fresa.protocol import UnitConverter
from fresa.protocol.gcode_modes import LETTERS

from .contract import Bits, Case, Component, Contract

__all__ = ["UNIT_CONVERTER"]

SMALL = 8
"""Largest width at which values are stated."""


def describe(c: Contract, dut: UnitConverter) -> None:
    """Lengths in inches and feeds are converted, each once, and nothing else is."""
    line = dut.line
    over = dut.done | dut.too_long
    goes_on = c.past(dut.run & ~over & ~c.rst)
    c.assume(~goes_on | (dut.run & (Value.cast(line) == c.past(Value.cast(line)))
                         & (dut.was_inverse == c.past(dut.was_inverse))))
    c.assume(dut.run | c.past(~dut.run | over | c.rst, init=1))
    if not c.upset:
        c.restrict_covers(~c.rst)
    state, letter = c.state("converter_state"), c.signal("letter")
    minutes = c.signal("minutes")
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
                & (~dut.run | state("SELECT") | wanted.bit_select(letter, 1))
                & (dut.run | (state("SELECT") & (letter == 0) & ~minutes))
                & (~minutes | feed), cover=converted == 2, lemma=True)
    c.implication("centre", "A centre that is not given is 0.", when=dut.write & ~stores,
                  then=(dut.data == 0)
                  & (centres & ~line.letters).bit_select(dut.address, 1))

    c.implication("stores-where-it-was", "A value is stored where it was.", when=stores,
                  then=dut.write & (dut.address == letter))
    if dut.width <= SMALL:
        _values(c, dut, state, feed)
    c.leaves_unused_codes("converter_state", fault=dut.fault,
                          shows=~dut.write & ~dut.done & ~dut.too_long)


def _values(c: Contract, dut: UnitConverter, state, feed: Bits) -> None:
    """State what a value becomes."""
    minutes, rest = c.signal("minutes"), c.signal("rest")
    number = c.signal("number")
    quotient = c.keep(len(number), name="quotient")
    count, stores = c.signal("count"), state("STORE")
    bits = dut.width + 7
    source = c.keep(dut.width, name="source")  # its magnitude
    minus = c.keep(1, name="minus")
    with c.m.If(state("LOAD")):
        c.m.d.sync += [source.eq(Mux(dut.word < 0, -dut.word, dut.word)), minus.eq(dut.word < 0)]
    with c.m.If(state("LIMIT")):
        c.m.d.sync += quotient.eq(number)
    dividend: Bits = Mux(minutes, source, (source << 7) - source + 2)[:bits]
    divisor: Bits = Mux(minutes, 60, 5)
    size = Mux(minus, -dut.data, dut.data)
    c.implication("length", "A length, or a feed in inches, is 25.4 of it, to the nearest, or the "
                  "longest that there is.", when=stores & ~minutes,
                  then=Mux(quotient[dut.width - 1:].any(), size == (1 << dut.width - 1) - 1,
                           (size * 5 <= dividend) & (dividend < size * 5 + 5)))
    top = (1 << dut.speed) - 1
    c.implication("feed", "A feed is a 60th of it, towards zero, from 1 to the highest, or 0.",
                  when=stores & minutes, then=Mux(
                      source == 0, size == 0, Mux(
                          source < 60, size == 1, Mux(source >= 60 * (top + 1), size == top,
                          (size * 60 <= source) & (source < size * 60 + 60)))))
    c.implication("too-long", "A length beyond reach is refused, and no other value.",
                  when=stores, then=dut.too_long == (
                      ~feed & (dividend >= (5 << dut.reach - 1))))
    magnitude: Bits = Mux(
        minutes, Mux(quotient > top, top, Mux(quotient == 0, source != 0, quotient)),
        Mux(quotient[dut.width - 1:].any(), (1 << dut.width - 1) - 1, quotient))
    beyond = ~feed & (magnitude >> dut.reach - 1).any()
    low = ((Const(1, bits + 1) << count) - 1)[:bits]
    c.invariant("division", "A bit of the quotient replaces one of the dividend.",
                (~state("DIVIDE") | ((count < bits) & (rest < divisor) & (
                    (number & ~low) == ((dividend << count) & ~low)[:bits])
                    & ((dividend >> (bits - count)[:6]) == (number & low) * divisor + rest)))
                & (~state("MULTIPLY") | (number == source))
                & (~state("LIMIT") | ((rest < divisor) & (number * divisor + rest == dividend)))
                & (~stores | ((rest < divisor) & (quotient * divisor + rest == dividend)))
                & (~stores | ((number[:dut.width] == Mux(minus, -magnitude, magnitude)[:dut.width])
                              & (c.signal("beyond") == beyond)))
                & (~state("NEGATE") | ((rest < divisor) & (quotient * divisor + rest == dividend)
                                       & (number == magnitude)))
                & (~state("SIGN") | (number.as_signed() == Mux(minus, -source, source)))
                & (state("SELECT", "FETCH", "LOAD") | ((c.signal("negative") == minus)
                                                       & (source <= 1 << dut.width - 1))),
                cover=stores, lemma=True)
    some, digits = c.signal("some"), number & low
    flags = [(c.signal(name), reach) for name, reach in (
        ("too_large", dut.width - 1), ("long", dut.reach - 1), ("too_fast", dut.speed))]
    c.invariant("digits", "Of the quotient it is known whether it is 0, and how long it is.",
                (~state("DIVIDE") | ((some == digits.any()) & Cat(
                    (count <= bits - reach)
                    | (flag == (digits >> (count - (bits - reach))[:6]).any())
                    for flag, reach in flags).all()))
                & (~state("LIMIT") | ((some == number.any()) & Cat(
                    flag == (number >> reach).any() for flag, reach in flags).all()))
                & (~state("NEGATE", "STORE") | Cat(
                    flag == (quotient >> reach).any() for flag, reach in flags).all()),
                cover=some, lemma=True)


UNIT_CONVERTER = Component(
    make=UnitConverter, describe=describe, depth=26,
    cases=(Case({"width": 8, "reach": 6, "speed": 2}), Case(real=True),
           Case({"width": 8, "reach": 6, "speed": 2}, upset=True)))
