"""Contract of steps made of quarter steps of another axis."""

from amaranth import Mux, signed

from fresa.motion import StepRatio

from .contract import Case, Component, Contract

__all__ = ["STEP_RATIO"]


def describe(c: Contract, dut: StepRatio) -> None:
    """Steps are the floor of the quarter steps' sum, whatever their directions."""
    known = c.past(1)
    before = c.past(dut.quarter)
    whole = dut.fine << 2
    c.assume((dut.coarse >= 1) & (dut.coarse <= dut.fine))
    c.assume(~known | ((dut.coarse == c.past(dut.coarse)) & (dut.fine == c.past(dut.fine))))
    c.assume(~dut.quarter | ~before)
    c.assume(~dut.load | (~dut.quarter & ~before & (dut.residual < whole)))

    # Residual that was loaded, and the quarter steps since in parts of a step, less steps made.
    owed = c.keep(signed(dut.width + 5), name="owed")
    made = Mux(dut.step, Mux(dut.direction, whole, -whole), 0)
    left = owed - made
    c.m.d.sync += owed.eq(Mux(dut.load, dut.residual, left + Mux(
        dut.quarter, Mux(dut.forward, dut.coarse, -dut.coarse), 0)))
    c.implication("floor", "The steps made are the floor of the residual and all quarter steps, "
                  "from the second clock after each: what is left is less than a step.",
                  when=~before, then=(left >= 0) & (left < whole))
    c.implication("residual-in-range", "The residual is in its range, but in the clock after a "
                  "quarter step.", when=~before,
                  then=(c.signal("residual") >= 0) & (c.signal("residual") < whole))
    c.invariant("residual-is-sum", "The residual is what is left.",
                c.signal("residual") == left, cover=dut.step, lemma=True)
    c.invariant("quarter-then-step", "The residual is brought back a clock after a quarter step.",
                c.signal("added") == before, cover=before, lemma=True)
    c.implication("within-two-clocks", "A step comes two clocks after a quarter step, in its "
                  "direction.", when=dut.step,
                  then=c.past(before) & (dut.direction == c.past(c.past(dut.forward))))


STEP_RATIO = Component(
    make=StepRatio, describe=describe, depth=14,
    cases=(Case({"width": 2}), Case({"width": 3}), Case({"width": 27}, real=True)))
