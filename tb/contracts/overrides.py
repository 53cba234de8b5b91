"""Contract of overrides: what commands make of percentages, and of outputs."""

from amaranth import Cat, Mux, Value

from fresa.motion import Overrides

from .contract import Bits, Case, Component, Contract

__all__ = ["OVERRIDES"]

SPINDLE_STOP, FLOOD, MIST = 0x9E, 0xA0, 0xA1


def describe(c: Contract, dut: Overrides) -> None:
    """By the codes of the bytes, as GRBL has them."""
    known = c.past(~c.rst)
    came = c.past(dut.command & ~c.rst & ~dut.restore)
    code = c.past(dut.code)
    restored = known & c.past(dut.restore)
    c.implication("restored", "All are 100 % when they are restored.", when=restored,
                  then=Cat(each == 100 for each in (dut.feed, dut.rapid, dut.spindle)).all())
    two = known & c.past(came & ~dut.restore)
    earlier = c.past(code)
    for name, percent, first in ("feed", dut.feed, 0x90), ("spindle", dut.spindle, 0x99):
        before = c.past(percent)
        mine = two & (earlier >= first) & (earlier <= first + 4)
        c.invariant(f"{name}-in-range", "A percentage is from 10 to 200.",
                    (percent >= 10) & (percent <= 200), cover=percent == 110)
        c.implication(f"{name}-is-reset", "It is 100 after a reset of it.",
                      when=mine & (earlier == first), then=percent == 100)
        for offset, change in (1, 10), (2, -10), (3, 1), (4, -1):
            c.implication(f"{name}-changes-by-{change}", "It changes as far as the range allows.",
                          when=mine & (earlier == first + offset),
                          then=percent == _bounded(before + change))
        c.implication(f"{name}-stays", "Nothing else changes it.", when=known & (percent != before),
                      then=mine | restored)
    rapid = came & (code >= 0x95) & (code <= 0x97)
    c.implication("rapid-is-chosen", "Of rapids there are three.", when=known & rapid,
                  then=dut.rapid == Mux(code == 0x95, 100, Mux(code == 0x96, 50, 25)))
    c.implication("rapid-stays", "Nothing else changes that of rapids.",
                  when=known & (dut.rapid != c.past(dut.rapid)), then=rapid | restored)
    shown: Bits = Cat(dut.feed, dut.rapid, dut.spindle, Value.cast(dut.outputs))
    c.implication("change-is-told", "A change is told when it shows, or a clock later.",
                  when=known & c.past(known) & c.past(shown != c.past(shown)),
                  then=dut.changed | c.past(dut.changed))

    # Outputs
    program, outputs = dut.program, dut.outputs
    stopped = c.keep(1, name="spindle_is_stopped")
    stood = c.keep(1, name="hold_stood")
    c.m.d.sync += [
        stood.eq(dut.standing & ~c.rst),
        stopped.eq(dut.held & ~c.rst & Mux(
            dut.laser & dut.standing & ~stood, 1,
            stopped ^ (dut.standing & dut.command & (dut.code == SPINDLE_STOP)))),
    ]
    off = stopped | dut.spindle_off
    c.invariant("spindle-stops", "A spindle that is stopped during a hold does not turn, nor one "
                "that is to be off.",
                Cat(outputs.clockwise == (program.clockwise & ~off),
                    outputs.counter_clockwise == (program.counter_clockwise & ~off)).all(),
                cover=stopped & program.clockwise)
    c.implication("laser-stops", "A laser is off in a hold that stands, until it is turned on.",
                  when=known & c.past(dut.laser & dut.held & dut.standing & ~c.past(
                      dut.standing & ~c.rst)),
                  then=~outputs.clockwise & ~outputs.counter_clockwise)
    was_stopped = c.keep(1, name="spindle_was_stopped")
    c.m.d.sync += was_stopped.eq(stopped & ~c.rst)
    c.invariant("spindle-restored", "That one turns again that was stopped is said, for a clock.",
                (c.signal("was_stopped") == was_stopped) & (dut.spindle_restored == (
                    was_stopped & ~stopped & (program.clockwise | program.counter_clockwise))),
                cover=dut.spindle_restored)
    c.invariant("stop-is-kept", "That it is stopped is kept.", c.signal("stopped") == stopped,
                cover=stopped, lemma=True)
    wanted: list[Bits] = []
    for name, which, kept in ("flood", FLOOD, "flooded"), ("mist", MIST, "misted"):
        mine, before = program[name], c.keep(1, name=f"{name}_of_program")
        switched = c.keep(1, name=f"{name}_is_switched")
        c.m.d.sync += [
            before.eq(mine & ~c.rst),
            switched.eq(~c.rst & (before == mine) & ~dut.restore & (
                switched ^ (dut.switches & dut.command & (dut.code == which))))]
        c.invariant(f"{name}-is-switched", "Coolant is switched by its command, until the program "
                    "switches it, and is off while it is to be.",
                    outputs[name] == ((mine ^ (switched & (before == mine))) & ~dut.coolant_off),
                    cover=switched)
        c.invariant(f"{name}-is-kept", "That it is switched is kept.",
                    (c.signal(kept) == switched) & (c.signal(f"{name}_before") == before),
                    cover=switched, lemma=True)
        wanted.append(mine ^ (switched & (before == mine)))
    c.invariant("coolant-is-known", "Whether coolant is to be on is known while it is off, too.",
                dut.coolant == Cat(wanted).any(), cover=dut.coolant & dut.coolant_off)


def _bounded(percent: Bits) -> Bits:
    return Mux(percent < 10, 10, Mux(percent > 200, 200, percent))


OVERRIDES = Component(make=Overrides, describe=describe, depth=18, cases=(Case(),))
