"""Contract of the filter of contacts, whose time is an input."""

from fresa.panel import ContactFilter

from .contract import Case, Component, Contract

__all__ = ["CONTACT_FILTER"]


def describe(c: Contract, dut: ContactFilter) -> None:
    """The output is high when the input has been high for the time, at once and no sooner."""
    c.assume(~c.past(1) | (dut.period == c.past(dut.period)))
    run = c.keep(range(dut.most + 1), name="run")  # clocks before this in which it was high
    with c.m.If(~dut.i):
        c.m.d.sync += run.eq(0)
    with c.m.Elif(run < dut.most):
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
    c.invariant("count-is-the-run", "The clocks of the input are counted until they are enough.",
                steady | (c.signal("count") == run), cover=run == 1)


CONTACT_FILTER = Component(
    make=ContactFilter, describe=describe,
    cases=(*(Case({"most": most}) for most in (3, 1)), Case({"most": (1 << 20) - 1}, real=True)))
