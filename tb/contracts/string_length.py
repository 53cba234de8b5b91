"""Contract of the length of a string: half a step from the true one, for ever."""

from math import isqrt

from amaranth import Mux, Signal, signed

from fresa.machines.vplotter import VPlotterSettings
from fresa.motion import StringLength
from fresa.motion.string_length import TICKS_LOG2

from .contract import Bits, Case, Component, Contract

__all__ = ["STRING_LENGTH"]

K = 1 << TICKS_LOG2

#: Bits up to which a solver knows what a product is.
MULTIPLIED = 4


def describe(c: Contract, dut: StringLength) -> None:
    """Places are what was asked for; the length is the nearest whole number to the true one."""
    length, busy = dut.length, dut.busy
    first_squares = sum(place**2 for place in dut.first)
    first_length = _nearest(first_squares)
    waits, ways, excess = c.signal("waits"), c.signal("ways"), c.signal("excess")
    short = ~dut.longer
    most = (1 << dut.bits) - 1
    known = ~c.past(0, init=1)
    fresh = c.past(c.rst | dut.begin, init=1)

    # Where the point was asked to be; the environment keeps it on the wall.
    asked = [c.keep(dut.bits, init=first, name=f"asked_{way}")
             for way, first in zip(("across", "below"), dut.first, strict=True)]
    for way, (place, ask) in enumerate(zip((dut.across, dut.below), asked, strict=True)):
        tick, away = dut.tick[way], dut.away[way]
        c.assume(~tick | (~waits[way] & Mux(away, ask != most, ask != 0)))
        with c.m.If(tick):
            c.m.d.sync += ask.eq(ask + Mux(away, 1, -1))
        with c.m.If(dut.begin | c.rst):
            c.m.d.sync += ask.eq(dut.first[way])
        late = Mux(waits[way], Mux(ways[way], 1, -1), 0)
        c.invariant(f"{('across', 'below')[way]}-is-what-was-asked",
                    "Each tick changes the place by one, and none is lost: at rest it is where it "
                    "was asked to be.", ask == place + late, cover=place > 1)

    numbers = {"across": dut.across, "below": dut.below, "length": length}
    firsts = {"across": dut.first[0], "below": dut.first[1], "length": first_length}
    sums = {name: _sum_of_odd_numbers(c, number, name, _room(dut.bits), fresh=fresh,
                                      first=firsts[name])
            for name, number in numbers.items()}
    before = c.past(dut.step)
    if dut.bits <= MULTIPLIED:
        for name, number in numbers.items():
            c.invariant(f"{name}-squared", "The sum of as many odd numbers as a number says is its "
                        "square.", sums[name] == number * number, cover=number > 1,
                        lemma=True)
        c.invariant("one-step-a-tick", "No step follows another in the next clock.",
                    ~(before & dut.step), cover=before)
    else:
        # That was of small numbers; here it says what squares are at the ends of the range.
        for name, number in numbers.items():
            c.assume((sums[name] <= _most(name, dut.bits) ** 2)
                     & ((number != 0) | (sums[name] == 0)))
        c.assume(~dut.step | short | (length != _most("length", dut.bits)))
    # Of numbers that fit: the squares are less than half of what this has room for.
    off = Signal(signed(_room(dut.bits)))
    c.m.d.comb += off.eq(sums["across"] + sums["below"] - K * K * sums["length"])
    error = excess + K * K // 4 + 1
    half = K * K * length + K * K // 4  # by how much the square of half a step more is more
    c.invariant("exact", "The error that is kept is that of the squares, exactly.",
                error == off, cover=dut.step)
    rest = known & ~busy
    c.implication("half-a-step-too-short", "At rest the string is not more than half a step "
                  "shorter than the way to the point.", when=rest, then=off <= half)
    c.implication("half-a-step-too-long", "At rest it is less than half a step longer.",
                  when=rest & (length != 0), then=off > K * K // 2 - half)
    c.implication("begins-where-it-is-first", "After a reset, or `begin`, it hangs where it does "
                  "at first, and has the nearest length to that.", when=fresh,
                  then=(length == first_length) & (dut.across == dut.first[0])
                  & (dut.below == dut.first[1]) & ~busy)
    changed = Mux(before, Mux(c.past(dut.longer), 1, -1), 0)
    c.invariant("no-lost-step", "The length changes by a step where one is given, and only there.",
                fresh | (length == c.past(length) + changed), cover=before)
    c.invariant("never-to-and-fro", "A step is not taken back in the next clock.",
                fresh | ~(before & dut.step & (dut.longer != c.past(dut.longer))), cover=before)

    # Lemmas: the error is bounded by what one tick adds to that of a right length.
    tick = 2 << dut.bits
    c.invariant("bounded", "The error is that of a right length and a tick.",
                (error <= half + tick) & (error > -half - tick), cover=dut.step, lemma=True)
    c.invariant("length-bounded", "The length does not wrap.",
                length <= _most("length", dut.bits), cover=length > 1, lemma=True)


def _nearest(squares: int) -> int:
    """Return the whole number of steps that is nearest to the root of a number of square ticks."""
    length = isqrt(squares) // K
    # Half a step more, or less than that: of two that are as near, the shorter.
    return length + (4 * squares > (K * (2 * length + 1))**2)


def _sum_of_odd_numbers(c: Contract, number: Bits, name: str, bits: int, *, fresh: Bits,
                        first: int) -> Bits:
    """Return the sum of as many odd numbers, from 1 on, as a number says that changes by ones."""
    total = Signal(bits, name=f"sum_{name}")
    before, past = c.past(number), c.past(total)
    c.m.d.comb += total.eq(past)
    with c.m.If(fresh):
        c.m.d.comb += total.eq(first**2)
    with c.m.Elif(number > before):
        c.m.d.comb += total.eq(past + 2 * before + 1)
    with c.m.Elif(number < before):
        c.m.d.comb += total.eq(past - 2 * number - 1)
    c.invariant(f"{name}-by-ones", "It changes by ones.",
                fresh | (number == before) | (number == before + 1) | (before == number + 1),
                cover=number > before, lemma=True)
    return total


def _room(bits: int) -> int:
    """Return bits of a signed number that holds the squares."""
    return 2 * bits + 3


def _most(name: str, bits: int) -> int:
    """Return the largest place, or length."""
    place = (1 << bits) - 1
    return isqrt(2 * place**2) // K + 1 if name == "length" else place


STRING_LENGTH = Component(
    make=StringLength, describe=describe, depth=24,
    cases=(Case({"bits": 4}), Case({"bits": 4, "first_across": 9, "first_below": 11}),
           # Both where they differ: hung from the middle they are alike.
           *(Case(dict(each), real=True) for each in dict.fromkeys(
               tuple(string.items()) for string in VPlotterSettings().string_lengths))))
