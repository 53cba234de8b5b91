"""Contract of the glitch filter."""

from fresa.panel import GlitchFilter

from .contract import Case, Component, Contract

__all__ = ["GLITCH"]


def describe(c: Contract, dut: GlitchFilter) -> None:
    """The output is high when the input has been high for a whole period, at once and no sooner."""
    run = c.keep(range(dut.period + 1), name="run")  # clocks before this in which it was high
    with c.m.If(~dut.i):
        c.m.d.sync += run.eq(0)
    with c.m.Elif(run < dut.period):
        c.m.d.sync += run.eq(run + 1)
    steady = run == dut.period
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
