"""Contract of the power of a spindle: its states, and that it is off when it has to be."""

from amaranth import Const, Mux

from fresa.drive import SpindlePower

from .contract import Case, Component, Contract

__all__ = ["SPINDLE_POWER"]


def describe(c: Contract, dut: SpindlePower) -> None:
    """What it is at full width is tested against numbers; here: when it changes, and its bounds."""
    known = ~c.past(0, init=1)
    state = c.state("power_state")
    if not c.upset:
        clock = c.keep(7, name="clock")
        c.m.d.sync += clock.eq(clock + 1)
        c.restrict_covers(~c.rst & (dut.on == (clock != 0)) & (dut.override == 100)
                          & (dut.speed == 3 << 28) & (dut.least == 0)
                          & (dut.most == 1 << 20) & dut.scaled & (dut.feed == 3)
                          & (dut.path_speed == 2))
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
    c.implication("ends", "Each computation ends after 63 clocks at most.", when=~state("FAULT"),
                  then=steps <= 63)
    step, half = c.signal("step"), Mux(second, 38, 0)
    more = Mux(second, 0, 13)  # multiples of the speed that are added, digit by digit
    for clock, name in enumerate(("SAMPLE", "TEST", "CLEAR")):
        c.implication(f"{name.lower()}-in-time", f"{name} comes in time.",
                      when=known & state(name) & ~begins, then=steps == half + clock, lemma=True)
    c.implication("add-in-time", "Each digit of the override comes in time.",
                  when=known & state("ADD"), then=(steps == half + 3 + Mux(second, 0, step))
                  & Mux(second, step == 13, step <= 13), lemma=True)
    for clock, name in enumerate(("LESS", "CLAMP")):
        c.implication(f"{name.lower()}-in-time", f"{name} comes in time.", when=known & state(name),
                      then=steps == half + more + 4 + clock, lemma=True)
    c.implication("divide-in-time", "Each step of a division comes in time.",
                  when=known & state("DIVIDE"),
                  then=(steps == half + more + 6 + step) & (step <= 17), lemma=True)
    for name in ("SHARE", "SHOW"):
        c.implication(f"{name.lower()}-in-time", f"{name} comes when its quotient is made.",
                      when=known & state(name),
                      then=(steps == half + more + 24) & (second == (name == "SHOW")), lemma=True)
    c.leaves_unused_codes("power_state", fault=dut.fault, shows=Const(1))


SPINDLE_POWER = Component(make=SpindlePower, describe=describe,
                          cases=(Case(), Case(upset=True)), depth=67)
