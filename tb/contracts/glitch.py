"""Contracts of the filters that a level passes when it has been steady."""

from amaranth import Array

from fresa.panel import ContactFilter, GlitchFilter

from .contract import Case, Component, Contract

__all__ = ["CONTACT_FILTER", "GLITCH"]


def describe(c: Contract, dut: GlitchFilter) -> None:
    """The output is high when the input has been high for a whole period, at once and no sooner."""
    run = c.keep(range(dut.period + 1), name="run")  # clocks before this in which it was high
    with c.m.If(~dut.i):
        c.m.d.sync += run.eq(0)
    with c.m.Elif(run < dut.period):
        c.m.d.sync += run.eq(run + 1)
    steady = (run != 0) & (run >= dut.period)
    c.implication("starts-low", "The output is low at power-up.", when=~c.past(1), then=~dut.o)
    c.implication("steady-passes", "An input that was high for `period` clocks passes at once.",
                  when=steady, then=dut.o)
    c.implication("glitch-blocked", "An input that was high for less time does not pass.",
                  when=~steady, then=~dut.o)
    c.implication("low-ends-it", "A low input ends the output with the next clock.",
                  when=c.past(dut.o & ~dut.i), then=~dut.o)
    c.implication("unaffected-by-reset", "Reset changes nothing.",
                  when=c.past(c.rst & dut.o & dut.i), then=dut.o)
    if dut.period > 1:
        c.invariant("count-is-the-run", "The divider counts the clocks of the input.",
                    steady | (c.signal("divider.count") + dut.period - 1 == run), cover=run == 1)


GLITCH = Component(
    make=GlitchFilter, describe=describe,
    cases=(*(Case({"period": period}) for period in (3, 2, 1)),
           Case({"period": 500}, real=True)))


def describe_contact(c: Contract, dut: ContactFilter) -> None:
    """Outputs are high when inputs have been so for a time, that stays; each by itself."""
    c.assume(~c.past(1) | (dut.period == c.past(dut.period)))
    interval = (dut.period >> 1) + 2  # clocks from a tick to the next
    count, tick = c.signal("count"), c.signal("tick")
    c.invariant("counts", "Ticks are half a period apart, and 2 clocks.",
                (count < interval) & (tick == (count + 1 == interval)), cover=tick)
    # Of one of them, whichever it is
    number = c.free(range(dut.width), name="number")
    c.assume((number < dut.width) & (~c.past(1) | (number == c.past(number))))
    run = c.keep(range(3 * ((dut.most >> 1) + 2) + 1), name="run")  # clocks before, if it was high
    level, passed = dut.i.bit_select(number, 1), dut.o.bit_select(number, 1)
    ticks = Array(c.signal(f"ticks_{each}") for each in range(dut.width))[number]
    with c.m.If(~level):
        c.m.d.sync += run.eq(0)
    with c.m.Elif(run < 3 * ((dut.most >> 1) + 2)):
        c.m.d.sync += run.eq(run + 1)
    c.implication("steady-passes", "An input that was high for one and a half periods passes.",
                  when=run >= 3 * interval, then=passed)
    c.implication("glitch-blocked", "One that was high for less than a period does not pass.",
                  when=run < dut.period + 4, then=~passed)
    # No product with 0, which has no bits in RTLIL: techmap of Yosys 0.70 makes wrong gates of one.
    for seen, before in enumerate((count, count + interval, count + 2 * interval)):
        c.invariant(f"in-ticks-{seen}", "It is kept in how many ticks it was high.",
                    ticks[seen] == (run > before), cover=ticks[seen], lemma=True)
    c.implication("low-ends-it", "A low input ends the output with the next clock.",
                  when=c.past(passed & ~level), then=~passed)
    c.implication("starts-low", "All are low at power-up.", when=~c.past(1), then=~dut.o.any())
    c.implication("unaffected-by-reset", "Reset changes nothing.",
                  when=c.past(c.rst & passed & level), then=passed)


CONTACT_FILTER = Component(
    make=ContactFilter, describe=describe_contact,
    cases=(*(Case({"width": 2, "most": most}) for most in (3, 1)),
           Case({"width": 7, "most": (1 << 20) - 1}, real=True)))
