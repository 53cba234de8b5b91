"""Contract of jogging by hand."""

from amaranth import Cat

from fresa.motion import ManualControl

from .contract import Case, Component, Contract

__all__ = ["MANUAL"]


def describe(c: Contract, dut: ManualControl) -> None:
    """Switches move axes, but none that has not been off since manual mode was entered."""
    seen_off = c.signal("seen_off")
    off = c.keep(6, name="watched_off")  # has been off since
    with c.m.If(c.rst | ~dut.enable):
        c.m.d.sync += off.eq(0)
    with c.m.Else():
        c.m.d.sync += off.eq(off | ~dut.jog)
    counts = dut.jog & off & dut.enable.replicate(6)
    c.invariant("seen-off", "A switch counts once it has been off in manual mode.",
                seen_off == off, cover=off.any())
    for axis, name in enumerate("xyz"):
        up, down = counts[2 * axis], counts[2 * axis + 1]
        c.implication(f"{name}-up", f"The switch {name} up sends {name} up, also with both on.",
                      when=up, then=dut.active[axis] & dut.direction[axis])
        c.implication(f"{name}-down", f"The switch {name} down alone sends {name} down.",
                      when=down & ~up, then=dut.active[axis] & ~dut.direction[axis])
        c.implication(f"{name}-off", f"Without a switch of {name} that counts, {name} rests.",
                      when=~up & ~down & dut.jog[2 * axis], then=~dut.active[axis]
                      & ~dut.step[axis])
    c.implication("only-manual", "Nothing is requested but in manual mode.",
                  when=~dut.enable & dut.jog.any(), then=(dut.step == 0) & (dut.active == 0))
    c.implication("held-at-entry", "A switch that is on when manual mode is entered does nothing.",
                  when=c.past(~dut.enable | c.rst) & dut.jog.any(), then=dut.active == 0)
    c.implication("together", "All axes that are jogged step in the same clock.",
                  when=dut.step.any(), then=dut.step == dut.active)

    active = dut.active.any()
    held = c.keep(range(dut.period + 1), name="held")  # clocks jogged since the last request
    with c.m.If(c.rst | ~active | dut.step.any()):
        c.m.d.sync += held.eq(0)
    with c.m.Elif(held < dut.period):
        c.m.d.sync += held.eq(held + 1)
    c.implication("timing", "A step is requested at every `period`-th clock of jogging, and no "
                  "other.", when=active, then=dut.step.any() == (held == dut.period - 1))
    if dut.period > 1:
        count = c.signal("divider.count")
        c.invariant("timing-is-the-count", "The divider counts the clocks of jogging.",
                    (count + dut.period - 1 == held) & (count <= 0),
                    cover=Cat(count).any() & active)


MANUAL = Component(
    make=ManualControl, describe=describe, depth=8,
    cases=(*(Case({"period": period}) for period in (2, 1)), Case({"period": 493_214}, real=True)))
