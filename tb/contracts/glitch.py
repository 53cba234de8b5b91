"""Contracts of the filters that a level passes when it has been steady."""

from fresa.panel import ContactFilter, GlitchFilter

from .contract import Bits, Case, Component, Contract

__all__ = ["CONTACT_FILTER", "GLITCH"]


def _steady(c: Contract, dut: GlitchFilter | ContactFilter, most: int) -> tuple[Bits, Bits]:
    """State when a level passes; return for how long it was high, and whether that is enough."""
    run = c.keep(range(most + 1), name="run")  # clocks before this in which it was high
    with c.m.If(~dut.i):
        c.m.d.sync += run.eq(0)
    with c.m.Elif(run < most):
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
    return run, steady


def describe(c: Contract, dut: GlitchFilter) -> None:
    """The output is high when the input has been high for a whole period, at once and no sooner."""
    run, steady = _steady(c, dut, dut.period)
    if dut.period > 1:
        c.invariant("count-is-the-run", "The divider counts the clocks of the input.",
                    steady | (c.signal("divider.count") + dut.period - 1 == run), cover=run == 1)


GLITCH = Component(
    make=GlitchFilter, describe=describe,
    cases=(*(Case({"period": period}) for period in (3, 2, 1)),
           Case({"period": 500}, real=True)))


def describe_contact(c: Contract, dut: ContactFilter) -> None:
    """The same for a period that is an input, and stays."""
    c.assume(~c.past(1) | (dut.period == c.past(dut.period)))
    run, steady = _steady(c, dut, dut.most)
    c.invariant("count-is-the-run", "The clocks of the input are counted until they are enough.",
                steady | (c.signal("count") == run + 2), cover=run == 1)
    c.invariant("known-ahead", "Whether the present clock makes them enough is known before.",
                steady | (c.signal("enough") == ((run != 0) & (run + 1 >= dut.period))),
                cover=c.signal("enough"), lemma=True)


CONTACT_FILTER = Component(
    make=ContactFilter, describe=describe_contact,
    cases=(*(Case({"most": most}) for most in (3, 1)), Case({"most": (1 << 20) - 1}, real=True)))
