"""Contract of the motor of a string: it counts what it makes, and makes what is wanted."""

from amaranth import Array, Mux

from fresa.drive import StringMotor
from fresa.machines.vplotter import VPlotterSettings

from .contract import Bits, Case, Component, Contract
from .phase import PHASE

__all__ = ["STRING_MOTOR"]


def describe(c: Contract, dut: StringMotor) -> None:
    """A step is made where it is wanted, towards the length, and counted; no other change is."""
    moved, made, length = dut.moved, dut.made, dut.length
    known, was_reset = c.past(1), c.past(c.rst, init=1)
    sets = dut.zero | dut.place
    before: Bits = c.past(made)
    goal: Bits = c.past(length)
    apart = Mux(made > goal, made - goal, goal - made)
    were_apart = Mux(before > goal, before - goal, goal - before)

    # By what a step is to be: a follower pays out where its string is too short.
    pays = Mux(dut.follow, made < length, dut.longer)
    rows = c.keep(range(len(dut.sequence)), name="rows")  # down the table, less back
    with c.m.If(moved):
        c.m.d.sync += rows.eq(rows + Mux(pays ^ dut.inverted, 1, -1))
    word: Bits = dut.coils

    c.implication("first", "At power-up and after a reset the string is as long as at first.",
                  when=was_reset, then=made == dut.first)
    c.implication("counts-steps", "A step makes the string longer or shorter by one.",
                  when=c.past(moved), then=made == (before + c.past(Mux(pays, 1, -1)))[:dut.bits])
    c.implication("only-on-a-step", "Otherwise its length stays, unless it is set.",
                  when=known & ~was_reset & ~c.past(moved | sets), then=made == before)
    c.implication("zero", "Then it is 0 where that is said.",
                  when=~was_reset & c.past(dut.zero), then=made == 0)
    c.implication("place", "Else it is what was wanted.",
                  when=~was_reset & c.past(dut.place & ~dut.zero), then=made == goal)
    c.implication("no-step-while-set", "While it is set no step is made.", when=moved,
                  then=~sets)
    c.implication("nearer", "A motor that follows comes nearer by one with each step.",
                  when=c.past(moved & dut.follow), then=apart == were_apart - 1)
    c.implication("wanted", "A step is made only while it is wanted, with power: one that is not "
                  "any more is not made.", when=moved,
                  then=dut.enable & ~c.rst & Mux(dut.follow, made != length, dut.step))
    c.invariant("behind", "It is behind where the string has not its length.",
                dut.behind == (made != length), cover=dut.behind)
    c.implication("made-when-rested", "A step that is wanted is made as soon as the coils rested.",
                  when=c.signal("driver.ready") & ~sets
                  & Mux(dut.follow, made != length, dut.step), then=moved)
    c.implication("coils-by-a-row", "A step changes the coils to the next row, and nothing else "
                  "does while there is power.",
                  when=known & c.past(dut.enable & (word != 0)) & (word != c.past(word)),
                  then=c.past(moved))
    c.invariant("coils-are-steps", "With power the coils are those of the steps that were made.",
                ~c.past(dut.enable) | (word == Array(dut.sequence)[rows]), cover=rows == 2)
    c.invariant("row-is-steps", "The row is the steps that were made, with power or without.",
                c.signal("driver.row") == rows, cover=rows == 3, lemma=True)
    c.implication("no-power", "Without power there is none, and no step.",
                  when=~c.past(dut.enable), then=(word == 0) & ~moved)
    c.keeps("driver", PHASE)


STRING_MOTOR = Component(
    make=StringMotor, describe=describe, depth=20,
    cases=(Case({"bits": 4, "period": 3}), Case({"bits": 4, "period": 2, "first": 5}),
           Case(VPlotterSettings().string_motors[0], real=True)))
