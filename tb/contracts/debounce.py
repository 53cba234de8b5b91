"""Contract of the debouncer."""

from amaranth import Const, Mux

from fresa.panel import Debouncer

from .contract import Case, Component, Contract

__all__ = ["DEBOUNCE"]


def describe(c: Contract, dut: Debouncer) -> None:
    """A level passes when it has been there for a whole period, and not sooner."""
    run = c.keep(range(2 * dut.period + 2), name="run")  # clocks before this for which input 0
    differs = dut.i[0] ^ dut.o[0]  # has differed
    changed = dut.o[0] != c.past(dut.o[0])
    so_far = Mux(changed, 0, run)
    c.m.d.sync += run.eq(Mux(differs, so_far + 1, 0))
    c.implication("starts-low", "All levels are low at power-up.", when=~c.past(1), then=dut.o == 0)
    age = c.keep(range(dut.period + 1), name="age")
    with c.m.If(age < dut.period):
        c.m.d.sync += age.eq(age + 1)
    c.implication("first-period-ignored", "The period of power-up is not counted: nothing changes "
                  "in it.", when=(age < dut.period) | c.past(age < dut.period), then=dut.o == 0)
    c.invariant("long-passes", "No input differs from its level for more than two periods.",
                so_far + differs <= 2 * dut.period, cover=so_far + differs == 2 * dut.period)
    c.implication("change-is-the-input", "A level changes to that of its input.",
                  when=changed, then=dut.o[0] == c.past(dut.i[0]))
    c.implication("unaffected-by-reset", "Reset changes no level.",
                  when=c.past(c.rst & (dut.i == dut.o)), then=dut.o == c.past(dut.o))
    c.implication("inputs-independent", "A level whose input does not differ stays, whatever the "
                  "others do.", when=c.past(~(dut.i[1] ^ dut.o[1]) & differs),
                  then=dut.o[1] == c.past(dut.o[1]))
    marked = c.signal("differs")[0]
    since = Const(0)  # clocks since the last tick
    if dut.period > 1:
        count = c.signal("divider.count")
        since = count + dut.period - 1
        c.implication("short-blocked", "A level changes only to one that lasted `period` "
                      "clocks.", when=changed, then=c.past(so_far) >= dut.period - 1)
        c.invariant("count-in-range", "The divider counts from 1 - period up to 0.",
                    (count <= 0) & (count >= 1 - dut.period), cover=count == 0)
    c.invariant("unmarked-before-first-tick", "Until the first tick no input is marked.",
                (age == dut.period) | ((since == age) & ~c.signal("differs").any()), cover=age == 1)
    c.implication("mark-is-a-period", "An input that is marked has differed since the last tick.",
                  when=marked, then=so_far >= since)
    c.implication("no-mark-no-period", "One that is not marked has not differed since before that "
                  "tick.", when=~marked, then=so_far <= since)
    c.invariant("longest-so-far", "None has differed longer than a period and the time since a "
                "tick.", so_far <= since + dut.period, cover=so_far == dut.period)


DEBOUNCE = Component(
    make=Debouncer, describe=describe, depth=12,
    cases=(*(Case({"width": 2, "period": period}) for period in (3, 2, 1)),
           Case({"width": 10, "period": 500_000}, real=True)))
