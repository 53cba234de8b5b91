"""Contract of the frequency divider."""

from fresa.drive import FrequencyDivider, divider

from .contract import Bug, Case, Component, Contract

__all__ = ["DIVIDER"]


def describe(c: Contract, dut: FrequencyDivider) -> None:
    """Ticks come at every `period`-th enabled clock, and at no other."""
    c.holds("tick-is-enabled", "A tick comes only in an enabled clock.",
            when=dut.tick, then=dut.enable,
            bug=Bug(divider, "self.tick.eq(self.enable & (count >= 0))",
                    "self.tick.eq(count >= 0)") if dut.period > 1 else
            Bug(divider, "self.tick.eq(self.enable)", "self.tick.eq(1)"))
    if dut.period == 1:
        c.holds("every-clock", "With period 1 every enabled clock is a tick.",
                when=dut.enable, then=dut.tick,
                bug=Bug(divider, "self.tick.eq(self.enable)",
                        "self.tick.eq(self.enable & ~self.clear)"))
        return

    count = c.signal("count")
    enabled = c.keep(range(dut.period), name="enabled")  # clocks since a tick, a clear or reset
    reset = c.rst & (not dut.reset_less)
    with c.m.If(reset | dut.clear | dut.tick):
        c.m.d.sync += enabled.eq(0)
    with c.m.Elif(dut.enable):
        c.m.d.sync += enabled.eq(enabled + 1)
    due = enabled == dut.period - 1

    c.holds("tick-when-due", "The period-th enabled clock is a tick.",
            when=dut.enable & due, then=dut.tick,
            bug=Bug(divider, "(count >= 0))", "(count > 0))"))
    c.holds("no-tick-before", "No earlier clock is a tick.",
            when=dut.enable & ~due, then=~dut.tick,
            bug=Bug(divider, "(count >= 0))", "(count >= -1))"))
    c.holds("waits", "While it is not enabled, the count stays.",
            when=~c.past(dut.enable | dut.clear | reset, init=1), then=count == c.past(count),
            bug=Bug(divider, "with m.If(self.enable):", "if True:"))
    c.holds("clear-starts-anew", "After a clear the whole period has to pass.",
            when=c.past(dut.clear), then=count == 1 - dut.period,
            bug=Bug(divider, "self.tick | self.clear", "self.tick"))
    if dut.reset_less:
        c.holds("lives-through-reset", "Reset changes nothing.",
                when=c.past(c.rst & ~dut.enable & ~dut.clear), then=count == c.past(count),
                bug=Bug(divider, "reset_less=self.reset_less", "reset_less=False"))
    c.always("count-up-to-0", "The count never passes 0.", count <= 0, seen=count == 0,
             bug=Bug(divider, "with m.If(self.tick | self.clear):", "with m.If(self.clear):"))
    c.always("count-is-the-time", "The count is the enabled clocks still to come, below 0.",
             count + dut.period - 1 == enabled, seen=due,
             bug=Bug(divider, "count.eq(count + 1)", "count.eq(count + 2)"))


DIVIDER = Component(
    make=FrequencyDivider, describe=describe,
    cases=(Case({"period": 3}), Case({"period": 3, "reset_less": True}),
           *(Case({"period": period}) for period in (2, 1)),
           Case({"period": 493_214}, real=True)))
