"""Contract of the driver that goes through a table."""

from amaranth import Array, Mux, Signal

from fresa.drive import HALF_STEP, ONE_PHASE, PhaseDriver, swap_inner

from .coil import watch_spacing
from .contract import Bits, Case, Component, Contract

__all__ = ["PHASE"]


def describe(c: Contract, dut: PhaseDriver) -> None:
    """A word of the table or none; a step is a row, and no word is gone too soon."""
    known, powered = c.past(1), c.past(dut.enable)
    moved, up = c.past(dut.moved), c.past(dut.direction)
    # Forward less back, counted beside it
    place = c.keep(range(len(dut.sequence)), name="place")
    with c.m.If(dut.moved):
        c.m.d.sync += place.eq(place + Mux(dut.direction, 1, -1))

    c.invariant("every-step", "With power the word is that of the steps forward less those back.",
                ~powered | (dut.coils == _word(c, dut, place)), cover=place == 2)
    c.invariant("row-is-net-steps", "The row is the steps forward less those back, power or not.",
                c.signal("row") == place, cover=place == 1)
    c.implication("no-power", "Without `enable` all coils are off from the next clock on.",
                  when=~powered, then=dut.coils == 0)
    before = c.past(dut.coils)
    c.implication("only-on-a-step", "While there is power and no step is made, the word stays.",
                  when=known & c.past(powered) & powered & ~moved, then=dut.coils == before)
    c.implication("forward", "A step with direction 1 goes down the table.", when=moved & up,
                  then=(before == _word(c, dut, place - 1)) & (dut.coils == _word(c, dut, place)))
    c.implication("back", "A step with direction 0 goes back.", when=moved & ~up,
                  then=(before == _word(c, dut, place + 1)) & (dut.coils == _word(c, dut, place)))
    c.implication("step-only-on-request", "A step is made only where it is requested, with power "
                  "and without reset.", when=dut.moved, then=dut.step & dut.enable & ~c.rst)
    c.implication("ready-implies-step", "When the driver is ready, a requested step is made.",
                  when=dut.ready & dut.step, then=dut.moved)

    rested = watch_spacing(c, dut.moved, dut.period)
    c.implication("spacing", "No step is made sooner than `period` clocks after the last, "
                  "also through resets and without power.", when=dut.moved,
                  then=rested >= dut.period - 1)
    held = c.keep(range(dut.period + 1), name="held")  # clocks before this with the word of now
    with c.m.If(~dut.enable | (dut.coils == 0) | dut.moved):
        c.m.d.sync += held.eq(0)
    with c.m.Elif(held < dut.period):
        c.m.d.sync += held.eq(held + 1)
    c.implication("word-lasts",
                  "No step is made before the coils had the word for `period` clocks.",
                  when=dut.moved, then=(held >= dut.period - 1) & (dut.coils != 0))
    c.implication("ready-after-period", "After `period` clocks with a word it is ready.",
                  when=dut.enable & (dut.coils != 0) & (held >= dut.period - 1) & ~c.rst,
                  then=dut.ready)
    c.invariant("rest-is-time-left", "The register `rest` is `period` less the clocks with a "
                "word.",
                c.signal("rest") == Mux(~powered, -dut.period, Mux(
                    held >= dut.period - 1, 0, held - (dut.period - 1))), cover=held == 0)
    c.invariant("held-at-most-rested", "The time with the present word is at most the time since "
                "the last step.",
                (held <= rested) & (powered == (dut.coils != 0)), cover=held == dut.period)


def _word(c: Contract, dut: PhaseDriver, place: Bits) -> Bits:
    row = Signal(range(len(dut.sequence)), name="looked_up")
    c.m.d.comb += row.eq(place)
    return Array(dut.sequence)[row]


PHASE = Component(
    make=PhaseDriver, describe=describe,
    cases=(*(Case({"sequence": ONE_PHASE, "period": period}) for period in (3, 2, 1)),
           Case({"sequence": HALF_STEP, "period": 2}),
           Case({"sequence": swap_inner(HALF_STEP), "period": 8_681}, real=True)))
