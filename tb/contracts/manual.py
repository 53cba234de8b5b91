"""Contract of jogging by hand."""

from amaranth import Cat

from fresa.drive import divider
from fresa.motion import ManualControl, manual

from .contract import Bug, Case, Component, Contract

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
    c.always("seen-off", "A switch counts once it has been off in manual mode.",
             seen_off == off, seen=off.any(),
             bug=Bug(manual, "m.d.sync += seen_off.eq(0)", "pass"))
    for axis, name in enumerate("xyz"):
        up, down = counts[2 * axis], counts[2 * axis + 1]
        c.holds(f"{name}-up", f"The switch {name} up sends {name} up, also with both on.",
                when=up, then=dut.active[axis] & dut.direction[axis],
                bug=Bug(manual, "up.eq(Cat(pressed[0::2]))",
                        f"up.eq(Cat(pressed[0::2]) & ~{1 << axis})"))
        c.holds(f"{name}-down", f"The switch {name} down alone sends {name} down.",
                when=down & ~up, then=dut.active[axis] & ~dut.direction[axis],
                bug=Bug(manual, "down.eq(Cat(pressed[1::2]))",
                        f"down.eq(Cat(pressed[1::2]) & ~{1 << axis})"))
        c.holds(f"{name}-off", f"Without a switch of {name} that counts, {name} rests.",
                when=~up & ~down & dut.jog[2 * axis], then=~dut.active[axis] & ~dut.step[axis],
                bug=Bug(manual, "self.jog & seen_off &", "self.jog & ~seen_off &"))
    c.holds("only-manual", "Nothing is asked for but in manual mode.",
            when=~dut.enable & dut.jog.any(), then=(dut.step == 0) & (dut.active == 0),
            bug=Bug(manual, "seen_off & self.enable.replicate(6)", "seen_off"))
    c.holds("held-at-entry", "A switch that is on when manual mode is entered does nothing.",
            when=c.past(~dut.enable | c.rst) & dut.jog.any(), then=dut.active == 0,
            bug=Bug(manual, "m.d.sync += seen_off.eq(0)", "m.d.sync += seen_off.eq(~self.jog)"))
    c.holds("together", "All axes that are jogged step in the same clock.",
            when=dut.step.any(), then=dut.step == dut.active,
            bug=Bug(manual, "self.active & divider.tick.replicate(3)",
                    "self.active & Cat(divider.tick, divider.tick, 0)"))

    active = dut.active.any()
    held = c.keep(range(dut.period + 1), name="held")  # clocks jogged since the last request
    with c.m.If(c.rst | ~active | dut.step.any()):
        c.m.d.sync += held.eq(0)
    with c.m.Elif(held < dut.period):
        c.m.d.sync += held.eq(held + 1)
    c.holds("timing", "A step is asked for at every `period`-th clock of jogging, and no other.",
            when=active, then=dut.step.any() == (held == dut.period - 1),
            bug=Bug(divider, "(count >= 0))", "(count >= -1))") if dut.period > 1 else
            Bug(manual, "divider.enable.eq(self.active.any())", "divider.enable.eq(up.any())"))
    if dut.period > 1:
        count = c.signal("divider.count")
        c.always("timing-is-the-count", "The divider counts the clocks of jogging.",
                 (count + dut.period - 1 == held) & (count <= 0), seen=Cat(count).any() & active,
                 bug=Bug(manual, "divider.clear.eq(~self.active.any())", "divider.clear.eq(0)"))


MANUAL = Component(
    make=ManualControl, describe=describe, depth=8,
    cases=(*(Case({"period": period}) for period in (2, 1)), Case({"period": 493_214}, real=True)))
