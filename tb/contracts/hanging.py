"""Contract of a point on two strings: where it is, and what both strings make of it."""

from amaranth import Cat, Mux

from fresa.machines.vplotter import VPlotterSettings
from fresa.motion import Hanging

from .contract import Bits, Case, Component, Contract
from .string_length import MULTIPLIED, STRING_LENGTH, K

__all__ = ["HANGING"]

#: Most ticks that wait: forward, and back.
FORWARD, BACK = 7, 8


def describe(c: Contract, dut: Hanging) -> None:
    """Each tick that is requested is made once by both strings, or taken back by another."""
    begins, drops = c.rst | dut.begin, dut.drop & ~dut.begin & ~c.rst
    left, right = dut.strings
    known, was_fresh = c.past(1), c.past(begins, init=1)
    most = (1 << len(dut.below)) - 1
    works = left.busy | right.busy
    waiting, kept, lost = [], [], []
    for way, (name, place, first, end) in enumerate((
            ("across", dut.across, left.first[0], dut.width),
            ("below", dut.below, left.first[1], most))):
        # `up` counts from below.
        onward = dut.direction[way] ^ bool(way)
        step, tick, ahead = dut.step[way], left.tick[way], left.away[way]
        # With a bit more than there is room for, so that a place beyond it is one.
        given = c.keep(len(place) + 1, init=first, name=f"given_{name}")  # to the strings
        asked = c.keep(len(place) + 1, init=first, name=f"asked_{name}")
        c.assume(~step | Mux(onward, asked < end, asked > 0))
        gap = (asked - given) if way == 0 else (given - asked)
        full = step & ~tick & Mux(dut.direction[way], gap == FORWARD, gap == -BACK)
        fault = c.keep(1, name=f"fault_{name}")
        after = given + Mux(tick, Mux(ahead, 1, -1), 0)
        with c.m.If(begins):
            c.m.d.sync += [given.eq(first), asked.eq(first), fault.eq(0)]
        with c.m.Else():
            c.m.d.sync += given.eq(after)
            with c.m.If(drops):
                c.m.d.sync += [asked.eq(after), fault.eq(0)]
            with c.m.Elif(step & ~full):
                c.m.d.sync += asked.eq(asked + Mux(onward, 1, -1))
            with c.m.Elif(full):
                c.m.d.sync += fault.eq(1)
        pending: Bits = c.part(f"pending_{'up' if way else 'across'}").pending
        waiting.append(asked != given)
        kept.append(pending)
        lost.append(fault)

        c.invariant(f"{name}-waits-or-is-made", "A tick that was requested was given to the "
                    "strings, or waits, or was taken back by one the other way.", pending == gap,
                    cover=gap == 2)
        c.implication(f"{name}-towards", "Each tick leads to where it shall be.", when=tick,
                      then=Mux(ahead, given < asked, given > asked))
        c.implication(f"{name}-at-rest", "At rest it is where it shall be.", when=known & ~dut.busy,
                      then=(place == asked) & (asked == given))
        c.invariant(f"{name}-on-the-wall", "It stays between its ends.",
                    (asked <= end) & (given <= end), cover=asked == 1)
        for side, string in (("left", left), ("right", right)):
            number = string.below if way else string.across
            mirrored = way == 0 and side == "right"
            waits = c.signal(f"{side}.waits")[way]
            late = Mux(waits, Mux(c.signal(f"{side}.ways")[way], 1, -1), 0)
            c.invariant(f"{side}-{name}", "A string is asked for what was given.",
                        number + late == (end - given if mirrored else given),
                        cover=waits, lemma=True)

    ticks: Bits = left.tick
    c.invariant("both-strings", "Both strings take a tick in the same clock, and from the right "
                "pulley it is the other way across.",
                (left.tick == right.tick) & (~ticks[0] | (left.away[0] != right.away[0]))
                & (~ticks[1] | (left.away[1] == right.away[1])), cover=ticks == 3)
    c.implication("one-at-a-time", "None is given while a string works on one.",
                  when=ticks.any(), then=~works)
    c.implication("at-once", "One that waits is given when neither does.",
                  when=Cat(waiting).any() & ~works, then=ticks == Cat(waiting))
    c.invariant("busy", "It is busy while a tick waits, or a string works on one.",
                dut.busy == (dut.step.any() | Cat(waiting).any() | works), cover=~dut.busy)
    c.invariant("fault", "A tick for which there was no room is a fault, and nothing else is.",
                dut.fault == Cat(lost).any(), cover=dut.fault)
    c.implication("begins-where-it-is-first", "After a reset, or `begin`, it is where it is at "
                  "first.", when=was_fresh, then=(dut.across == left.first[0])
                  & (dut.below == left.first[1]) & (right.across == dut.width - left.first[0])
                  & ~(dut.busy & ~dut.step.any())
                  & Cat(length == string.first_length for length, string in zip(
                      dut.lengths, dut.strings, strict=True)).all())
    c.implication("drops", "What waits is forgotten with `drop`.", when=c.past(drops),
                  then=~Cat(kept).any())
    if len(dut.below) <= MULTIPLIED:
        for side in ("left", "right"):
            c.keeps(side, STRING_LENGTH, reset=c.rst)
        for name, length, string in zip(("left", "right"), dut.lengths, dut.strings, strict=True):
            across, below = string.across, string.below
            off = across * across + below * below - K * K * (length * length)
            half = K * K * length + K * K // 4
            c.implication(f"{name}-half-a-step", "At rest a string is within half a step of the "
                          "way to its pulley.", when=known & ~dut.busy, then=(off <= half)
                          & ((length == 0) | (off > K * K // 2 - half)))
    c.implication("between-the-pulleys", "At rest both strings end at the same place.",
                  when=known & ~dut.busy, then=(right.across == dut.width - dut.across)
                  & (right.below == dut.below) & (left.across == dut.across))


HANGING = Component(
    make=Hanging, describe=describe, depth=20,
    cases=(Case({"width": 13, "first_across": 5, "first_below": 14, "bits": 4}),
           Case(VPlotterSettings().hanging, real=True)))
