"""Contract of the rate of steps."""

from amaranth import Mux

from fresa.drive import RateGenerator

from .coil import watch_spacing
from .contract import Bits, Case, Component, Contract

__all__ = ["RATE", "watch_spaced"]


def describe(c: Contract, dut: RateGenerator) -> None:
    """The steps are the sum of the rates, and never closer than the highest allows."""
    made = dut.due & dut.moved
    given = Mux(dut.rate > dut.max_rate, dut.max_rate, dut.rate)
    waits = dut.due & ~dut.moved
    # The sum of the rates less a modulus a step, from the end of the last wait: in this clock the
    # step has its exact time where the sum is a modulus, and is so many of the rate's parts of a
    # clock late as the sum is above it. There are bits enough for a generator that is wrong. At
    # power-up a step is due.
    owed = c.keep(range(-2 * dut.modulus, 4 * dut.modulus), init=dut.modulus, name="owed")
    c.m.d.sync += owed.eq(Mux(waits, dut.modulus, owed + given - Mux(made, dut.modulus, 0)))

    c.implication("less-than-a-clock-late", "A step comes due less than a clock after its exact "
                  "time: what is beyond it was not there before the rate of the clock before.",
                  when=dut.due & c.past(1), then=Mux(
                      c.past(waits), owed == dut.modulus, owed - c.past(given) < dut.modulus))
    c.invariant("no-drift", "The rates that were given, less a modulus for each step that was "
                "made, are less than a step that is due and a clock.",
                (owed >= 0) & (owed < dut.modulus + dut.max_rate), cover=made)
    c.invariant("due-at-exact-time", "A step is due from its exact time on, and never before: "
                "where the rates since the last step that waited add up to a modulus.",
                dut.due == (owed >= dut.modulus), cover=dut.due)
    c.invariant("accumulator-is-sum", "The accumulator is the sum of rates minus that of steps.",
                c.signal("accumulator") == owed - dut.modulus, cover=dut.due)
    c.implication("due-until-made", "A step that is due stays due until it is made.",
                  when=c.past(dut.due & ~dut.moved), then=dut.due)
    c.implication("rate-0", "With rate 0 no step comes due.",
                  when=c.past(~dut.due & (dut.rate == 0)), then=~dut.due)

    watch_spaced(c, dut, owed, alone=True)


def watch_spaced(c: Contract, dut: RateGenerator, owed: Bits, *, alone: bool = False) -> None:
    """State that steps are not too close; `owed` is the accumulator, with steps that are due.

    `alone` is a generator without a motor, which has to get ready first.
    """
    made = dut.due & dut.moved
    least = dut.modulus // dut.max_rate
    rested = watch_spacing(c, made, least)
    if least > 1:
        c.implication("spacing", "Two steps are never closer than those of the highest rate, "
                      "for any rates, and however long a step waited.", when=made,
                      then=rested >= least - 1)
    c.invariant("accumulator-bounds-spacing", "The accumulator is bounded by the time since a "
                "step.",
                (rested == least) | (owed < (rested + 2) * dut.max_rate), cover=rested == 0)


RATE = Component(
    make=RateGenerator, describe=describe, depth=16,
    cases=(*(Case({"modulus": modulus, "max_rate": rate})
             for modulus, rate in [(7, 2), (8, 3), (9, 4), (3, 3), (1, 1)]),
           *(Case({"modulus": modulus, "max_rate": rate}, real=True) for modulus, rate in [
               (50_000_000, 1_500), (62_500_000, 59_999), (50_000_000, 1_000_000)])))
