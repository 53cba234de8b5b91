"""Contract of squaring: a motor is halted by its own switch, and not for long alone."""

from amaranth import Mux

from fresa.motion import MotorSquaring

from .contract import Case, Component, Contract

__all__ = ["SQUARING"]


def describe(c: Contract, dut: MotorSquaring) -> None:
    """Compare with the switches that there were since the axis began to seek."""
    met = c.keep(2, name="met")  # before this clock, while it seeks
    c.m.d.sync += met.eq(Mux(dut.seeks & ~c.rst, met | dut.switches, 0))
    c.invariant("halted-by-its-switch", "A motor is halted if its own switch was on before, while "
                "the axis sought it, and only then.", dut.halt == met, cover=met.all())
    c.implication("free-otherwise", "A clock after the axis does not seek, no motor is halted.",
                  when=~c.past(dut.seeks), then=dut.halt == 0)

    lone = met.any() & ~met.all() & dut.seeks & ~c.rst
    steps = c.keep(dut.width + 1, name="lone_steps")  # of one motor without the other
    c.m.d.sync += steps.eq(Mux(lone, steps + (dut.moved & (steps <= dut.most)), 0))
    c.implication("fails-beyond", "It fails two clocks after a motor has made more steps alone, "
                  "while it is alone.", when=c.past(lone & (steps > dut.most)), then=dut.failed)
    c.implication("fails-no-sooner", "It does not fail before.", when=dut.failed,
                  then=c.past(lone & (steps > dut.most)))
    c.invariant("counted", "The steps are counted.", c.signal("count") == steps,
                cover=steps > 1, lemma=True)


SQUARING = Component(make=MotorSquaring, describe=describe, depth=10,
                     cases=(Case({"width": 2}), Case({"width": 27}, real=True)))
