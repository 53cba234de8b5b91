"""Contract of what turns spindle and coolant off at an open door, and on again."""

from amaranth import Mux

from fresa.motion import AccessoryRestart

from .contract import Case, Component, Contract

__all__ = ["ACCESSORY_RESTART"]


def describe(c: Contract, dut: AccessoryRestart) -> None:
    """Off at once, on one after the other, and each has its time."""
    known = c.past(~c.rst)
    lets = c.past(dut.release & ~dut.off)
    spindle_off, coolant_off = dut.spindle_off, dut.coolant_off
    c.implication("off-in-a-clock", "What is to be off is so in the next clock.",
                  when=known & c.past(dut.off), then=spindle_off & coolant_off)
    c.implication("released", "What is released is on, or off, as the program wants, in the next.",
                  when=known & lets, then=~spindle_off & ~coolant_off)
    turned = known & ~c.past(dut.off)
    for name, off in ("spindle", spindle_off), ("coolant", coolant_off):
        c.implication(f"{name}-off-for-a-reason", "Nothing else turns one off.",
                      when=turned & off, then=c.past(off))
        c.implication(f"{name}-on-for-a-reason", "And only a restart turns one on.",
                      when=turned & c.past(off) & ~off, then=lets | c.past(dut.restart))

    # The beats since one was turned on that has to be waited for, as far as they count
    spins = turned & c.past(spindle_off) & ~spindle_off & ~lets
    cools = turned & c.past(coolant_off) & ~coolant_off & ~lets
    left = c.signal("left")
    due = c.keep(len(left), name="due")  # beats, before this clock
    now = Mux(
        spins, Mux(c.past(dut.spindle & ~dut.laser), 1 << dut.spindle_log2, 0),
        Mux(cools, Mux(c.past(dut.coolant), 1 << dut.coolant_log2, 0), due))
    c.m.d.sync += due.eq(Mux(c.rst | dut.off | dut.release, 0, now - (dut.beat & (now != 0))))
    c.invariant("counts", "What is left is the time of what was turned on last.", left + 1 == now,
                cover=now == 2, lemma=True)
    c.implication("waits-for-the-spindle", "Coolant waits until the spindle has its speed.",
                  when=cools & ~c.past(dut.laser), then=c.past(~spindle_off & (now == 0)))
    c.implication("laser-last", "A laser waits until the coolant has had its time.",
                  when=spins & c.past(dut.laser), then=c.past(~coolant_off & (now == 0)))
    c.implication("both-on", "It is through when both are on, and the last has had its time.",
                  when=dut.restarted, then=~spindle_off & ~coolant_off & (now == 0))
    c.implication("through", "It is so at once.", when=~spindle_off & ~coolant_off & (now == 0),
                  then=dut.restarted)
    c.implication("goes-on", "As soon as nothing is waited for the next is turned on.",
                  when=turned & c.past(dut.restart & (now == 0) & ~dut.release
                                       & (spindle_off | coolant_off)),
                  then=(c.past(spindle_off) & ~spindle_off) | (c.past(coolant_off) & ~coolant_off))


ACCESSORY_RESTART = Component(
    make=AccessoryRestart, describe=describe, depth=14,
    cases=(Case({"spindle_log2": 2, "coolant_log2": 1}),
           Case({"spindle_log2": 1, "coolant_log2": 0}),
           Case({"spindle_log2": 12, "coolant_log2": 10}, real=True)))
