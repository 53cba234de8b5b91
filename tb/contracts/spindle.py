"""Contract of the power of a spindle: its states, and that it is off when it has to be."""

from amaranth import Const

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
    steps = c.keep(7, name="clocks")
    c.m.d.sync += steps.eq(steps + 1)
    with c.m.If(c.rst | ~dut.on | state("SAMPLE", "FAULT")):
        c.m.d.sync += steps.eq(1)
    digit = c.signal("digit")
    c.implication("ends", "Each computation ends after 53 clocks at most.", when=~state("FAULT"),
                  then=steps <= 53)
    at = {"PATH": 17, "SCALE": 34, "SHOW": 52}
    for name, most in at.items():
        c.implication(f"{name.lower()}-in-time", f"{name} comes in time.",
                      when=known & state(name), then=steps <= most, lemma=True)
    for name, begin in (("SPEED", 1), ("SHARE", 18), ("MULTIPLY", 35)):
        c.implication(f"{name.lower()}-in-time", f"So many digits of {name} are done.",
                      when=known & state(name), then=steps <= begin + digit, lemma=True)
        c.implication(f"{name.lower()}-digits", f"{name} has no more digits.",
                      when=state(name), then=digit <= 16 - (name != "MULTIPLY"), lemma=True)
    c.implication("digits-begin", "Each begins with its first digit.",
                  when=state("PATH", "SCALE"), then=digit == 0, lemma=True)
    c.leaves_unused_codes("power_state", fault=dut.fault, shows=Const(1))


SPINDLE_POWER = Component(make=SpindlePower, describe=describe,
                          cases=(Case(), Case(upset=True)), depth=56)
