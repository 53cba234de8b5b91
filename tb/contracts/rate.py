"""Contract of the rate of steps."""

from amaranth import Mux

from fresa.drive import RateGenerator, rate

from .coil import watch_spacing
from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["RATE", "watch_spaced"]

RESET_LESS = "init=-self.modulus, reset_less=True"


def describe(c: Contract, dut: RateGenerator) -> None:
    """The steps are the sum of the rates, for ever, and never closer than the highest allows."""
    made = dut.due & dut.moved
    given = Mux(dut.rate > dut.max_rate, dut.max_rate, dut.rate)
    # All rates of the clocks in which none waited, less a modulus a step: there are bits enough
    # that it is what it says.
    owed = c.keep(range(-2 * dut.modulus, 4 * dut.modulus), name="owed")
    c.m.d.sync += owed.eq(owed + Mux(made | ~dut.due, given, 0) - Mux(made, dut.modulus, 0))

    c.always("no-drift", "The rates that were given, less a modulus for each step that was made, "
             "are less than a step that is due and a clock, for ever.",
             (owed >= 0) & (owed < dut.modulus + dut.max_rate), seen=made,
             bug=(Bug(rate, "rate - self.modulus, rate", "rate - self.modulus + 1, rate"),
                  Bug(rate, "Mux(self.due, rate - self.modulus, rate)",
                      "Mux(self.due, -self.modulus, rate)")))
    c.always("due-when-owed", "A step is due when the rates come to a modulus, and not before.",
             dut.due == (owed >= dut.modulus), seen=dut.due,
             bug=(Bug(rate, "accumulator >= 0", "accumulator >= -1"),
                  Bug(rate, "accumulator >= 0", "accumulator > 0"),
                  Bug(rate, RESET_LESS, "init=-self.modulus"),
                  Bug(rate, "self.rate > self.max_rate, self.max_rate",
                      "self.rate > self.max_rate, self.max_rate - 1")
                  if dut.max_rate + 1 & dut.max_rate else
                  Bug(rate, "self.max_rate, self.rate", "self.max_rate, self.rate ^ 1")))
    c.always("sum-is-what-is-owed", "The sum inside is what is owed.",
             c.signal("accumulator") == owed - dut.modulus, seen=dut.due,
             bug=Bug(rate, RESET_LESS, "init=1 - self.modulus, reset_less=True"))
    c.holds("waits", "A step that is due stays due until it is made.",
            when=c.past(dut.due & ~dut.moved), then=dut.due,
            bug=(Bug(rate, "~self.due | self.moved", "1"), Bug(rate, RESET_LESS,
                                                               "init=-self.modulus")))
    c.holds("rate-0", "With rate 0 no step comes due.",
            when=c.past(~dut.due & (dut.rate == 0)), then=~dut.due,
            bug=Bug(rate, "self.max_rate, self.rate", "self.max_rate, self.rate | 1"))

    watch_spaced(c, dut, owed, alone=True)


def watch_spaced(c: Contract, dut: RateGenerator, owed: Bits, *, alone: bool = False) -> None:
    """Promise that steps are not too close; `owed` is the sum, also of what is due.

    `alone` is a generator without a motor, which has to get ready first.
    """
    made = dut.due & dut.moved
    least = dut.modulus // dut.max_rate
    rested = watch_spacing(c, made, least)
    if least > 1:
        c.holds("spacing", "Two steps are never closer than those of the highest rate, whatever "
                "rates are given, and however long one waited.",
                when=made, then=rested >= least - 1,
                bug=(Bug(rate, "rate - self.modulus, rate", "rate - self.modulus // 2, rate"),
                     *[Bug(rate, RESET_LESS, "init=-1")] * alone))
    c.always("spacing-is-in-the-sum", "What is owed so long after a step is no more than that.",
             (rested == least) | (owed < (rested + 2) * dut.max_rate), seen=rested == 0,
             bug=Bug(rate, "self.max_rate, self.rate", "self.max_rate, self.max_rate + self.rate"))


RATE = Component(
    make=RateGenerator, describe=describe, depth=16,
    cases=(*(Case({"modulus": modulus, "max_rate": rate})
             for modulus, rate in [(7, 2), (8, 3), (9, 4), (3, 3), (1, 1)]),
           *(Case({"modulus": modulus, "max_rate": rate}, real=True) for modulus, rate in [
               (50_000_000, 1_500), (62_500_000, 59_999), (50_000_000, 1_000_000)])))
