"""Contract of the power of a spindle: its states, and that it is off when it has to be."""

from amaranth import Const, Mux

from fresa.drive import SpindlePower

from .contract import Case, Component, Contract

__all__ = ["SPINDLE_POWER"]


def describe(c: Contract, dut: SpindlePower) -> None:
    """What it is at full width is tested against numbers; here: when it changes, and its bounds."""
    known = ~c.past(0, init=1)
    state = c.state("power_state")
    c.implication("off-in-a-clock", "A spindle that is off has no power a clock later.",
                  when=known & c.past(~dut.on), then=dut.power == 0)
    c.implication("starts-anew", "What was computed before it was switched on is not shown.",
                  when=known & c.past(~dut.on) & ~dut.fault, then=state("SAMPLE"))
    c.implication("changes-at-the-end", "The power changes when a computation ends, or it is off.",
                  when=known & ~c.past(c.rst) & (dut.power != c.past(dut.power)),
                  then=c.past(state("SHOW") | ~dut.on | dut.fault))
    steps, second = c.keep(7, name="clocks"), c.signal("second")
    begins = state("SAMPLE") & ~second
    c.m.d.sync += steps.eq(steps + 1)
    with c.m.If(c.rst | ~dut.on | begins | state("FAULT")):
        c.m.d.sync += steps.eq(1)
    c.implication("ends", "Each computation ends after 50 clocks at most.", when=~state("FAULT"),
                  then=steps <= 50)
    step, half = c.signal("step"), Mux(second, 25, 0)
    for clock, name in enumerate(("SAMPLE", "TEST", "CLEAR", "ADD", "LESS", "CLAMP")):
        c.implication(f"{name.lower()}-in-time", f"{name} comes in time.",
                      when=known & state(name) & ~begins, then=steps == half + clock, lemma=True)
    c.implication("divide-in-time", "Each step of a division comes in time.",
                  when=known & state("DIVIDE"), then=(steps == half + 6 + step) & (step <= 17),
                  lemma=True)
    for name in ("SHARE", "SHOW"):
        c.implication(f"{name.lower()}-in-time", f"{name} comes when its quotient is made.",
                      when=known & state(name),
                      then=(steps == half + 24) & (second == (name == "SHOW")), lemma=True)
    c.leaves_unused_codes("power_state", fault=dut.fault, shows=Const(1))


SPINDLE_POWER = Component(make=SpindlePower, describe=describe,
                          cases=(Case(), Case(upset=True)), depth=54)
