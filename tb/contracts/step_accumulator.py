"""Contract of the fraction of a step."""

from amaranth import Mux, signed

from fresa.motion import StepAccumulator

from .contract import Case, Component, Contract

__all__ = ["STEP_ACCUMULATOR"]


def describe(c: Contract, dut: StepAccumulator) -> None:
    """Steps and fraction are exactly the sum of what was added."""
    fraction = c.signal("fraction")
    one, quarter = 1 << dut.width, 1 << dut.width - 2
    added, term = c.past(dut.add), c.past(dut.term)
    known = c.past(1)

    # Sum since the last load, less a step for each that came: of a load in this clock's past, the
    # step that was on its way belongs to the sum before.
    position = c.keep(signed(dut.width + 3), name="position")
    loaded = c.past(dut.load)
    made = Mux(dut.step & ~loaded, Mux(dut.direction, one, -one), 0)
    left = position - made
    c.m.d.sync += position.eq(Mux(dut.load, dut.start << dut.width - 8,
                                  left + Mux(dut.add, dut.term, 0)))
    c.invariant("exact", "The fraction is what was loaded and all that was added since, less the "
                "steps that came.", fraction == left, cover=dut.step)
    c.implication("one-step", "A step comes in the clock after an addition, in its direction.",
                  when=dut.step, then=added & (dut.direction == (term >= 0)))
    total = c.past(fraction) + term
    c.implication("one-step-a-crossing", "There is a step if, and only if, the sum passes a whole "
                  "number.", when=added & known,
                  then=dut.step == ((total < 0) | (total >= one)))
    small = (term < quarter) & (term > -quarter)
    passed = (total >> dut.width - 2) != (c.past(fraction) >> dut.width - 2)
    c.implication("one-quarter-a-crossing", "There is a quarter step if, and only if, the sum "
                  "passes a whole number of quarter steps, of which it never passes two.",
                  when=added & known & small, then=dut.quarter == passed)
    c.implication("nothing-by-itself", "Without an addition there is neither.",
                  when=~added, then=~dut.step & ~dut.quarter)
    c.implication("load", "A load begins with its start, whatever is added with it.",
                  when=loaded, then=fraction == c.past(dut.start) << dut.width - 8)


STEP_ACCUMULATOR = Component(
    make=StepAccumulator, describe=describe, depth=8,
    cases=(Case({"width": 8}), Case({"width": 10}), Case({"width": 44}, real=True)))
