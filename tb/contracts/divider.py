"""Contract of the frequency divider."""

from fresa.drive import FrequencyDivider

from .contract import Case, Component, Contract

__all__ = ["DIVIDER"]


def describe(c: Contract, dut: FrequencyDivider) -> None:
    """Ticks come at every `period`-th enabled clock, and at no other."""
    c.implication("tick-is-enabled", "A tick comes only in an enabled clock.",
                  when=dut.tick, then=dut.enable)
    if dut.period == 1:
        c.implication("every-clock", "With period 1 every enabled clock is a tick.",
                      when=dut.enable, then=dut.tick)
        return

    count = c.signal("count")
    enabled = c.keep(range(dut.period), name="enabled")  # clocks since a tick, a clear or reset
    reset = c.rst & (not dut.reset_less)
    with c.m.If(reset | dut.clear | dut.tick):
        c.m.d.sync += enabled.eq(0)
    with c.m.Elif(dut.enable):
        c.m.d.sync += enabled.eq(enabled + 1)
    due = enabled == dut.period - 1

    c.implication("tick-when-due", "The period-th enabled clock is a tick.",
                  when=dut.enable & due, then=dut.tick)
    c.implication("no-tick-before", "No earlier clock is a tick.",
                  when=dut.enable & ~due, then=~dut.tick)
    c.implication("count-held-while-disabled", "While it is not enabled, the count stays.",
                  when=~c.past(dut.enable | dut.clear | reset, init=1), then=count == c.past(count))
    c.implication("clear-restarts", "After a clear the whole period has to pass.",
                  when=c.past(dut.clear), then=count == 1 - dut.period)
    if dut.reset_less:
        c.implication("unaffected-by-reset", "Reset changes nothing.",
                      when=c.past(c.rst & ~dut.enable & ~dut.clear), then=count == c.past(count))
    c.invariant("count-up-to-0", "The count never passes 0.", count <= 0, cover=count == 0)
    c.invariant("count-is-time-left", "The count is the enabled clocks still to come, below 0.",
                count + dut.period - 1 == enabled, cover=due)


DIVIDER = Component(
    make=FrequencyDivider, describe=describe,
    cases=(Case({"period": 3}), Case({"period": 3, "reset_less": True}),
           *(Case({"period": period}) for period in (2, 1)),
           Case({"period": 493_214}, real=True)))
