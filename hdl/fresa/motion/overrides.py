"""What an operator changes while a program runs: feed, rapids, spindle and coolant."""

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..protocol import RealtimeCode
from .blocks import Outputs, OverrideKind

__all__ = ["OVERRIDE_BITS", "Overrides", "override_of"]

OVERRIDE_BITS = 8
"""Bits of a percentage."""

NORMAL, LEAST, MOST = 100, 10, 200
"""Percentages at first, and the bounds of those of feed and spindle."""


def override_of(kind: Value, *, feed: Value, rapid: Value) -> Value:
    """Return the percentage that a motion obeys, by its `OverrideKind`."""
    return Mux(kind == OverrideKind.RAPID, rapid, Mux(kind == OverrideKind.NONE, NORMAL, feed))


_STEPS = (RealtimeCode.FEED_RESET, RealtimeCode.SPINDLE_RESET), (
    (RealtimeCode.FEED_PLUS_10, RealtimeCode.SPINDLE_PLUS_10, 10),
    (RealtimeCode.FEED_MINUS_10, RealtimeCode.SPINDLE_MINUS_10, -10),
    (RealtimeCode.FEED_PLUS_1, RealtimeCode.SPINDLE_PLUS_1, 1),
    (RealtimeCode.FEED_MINUS_1, RealtimeCode.SPINDLE_MINUS_1, -1))


class Overrides(wiring.Component):
    """Keeps the overrides of GRBL, and changes them by its real-time commands.

    Feed and spindle change by 10 or 1, and stay from 10 to 200 %. Rapids have 100, 50 or 25 %. A
    change shows in the second clock after its command at the latest.

    Spindle stop counts while a hold stands: the spindle is off, and on again at the next one, or
    when it is held no more. A laser is off from the clock after that in which the hold stands.
    Flood and mist are what the program has not switched, from their commands until the program
    switches them.

    Members
    -------
    command, code : In(1), In(8)
        A real-time command, as of :class:`RealtimeFilter`.
    restore : In(1)
        Make all percentages 100, and what the program switches be on alone, in this clock.
    switches : In(1)
        Coolant may be switched.
    standing, held : In(1)
        A hold stands; what it has stopped stays so, as with an open door.
    laser : In(1)
        The spindle is a laser.
    spindle_off, coolant_off : In(1)
        It is off, whatever the program and the operator want.
    program : In(Outputs)
        What the program switches.
    feed, rapid, spindle : Out(8)
        In percent.
    outputs : Out(Outputs)
        What is on.
    spindle_restored : Out(1)
        A spindle that was stopped so turns again, for one clock.
    coolant : Out(1)
        Flood or mist is to be on, whether it is off by ``coolant_off`` or not.
    changed : Out(1)
        A percentage has changed, or may have, or an output: for one clock, after it shows.
    """

    command: In(1)
    code: In(8)
    restore: In(1)
    switches: In(1)
    standing: In(1)
    held: In(1)
    laser: In(1)
    spindle_off: In(1)
    coolant_off: In(1)
    program: In(Outputs)
    feed: Out(OVERRIDE_BITS, init=NORMAL)
    rapid: Out(OVERRIDE_BITS, init=NORMAL)
    spindle: Out(OVERRIDE_BITS, init=NORMAL)
    outputs: Out(Outputs)
    spindle_restored: Out(1)
    coolant: Out(1)
    changed: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()
        # One adder for both: what it adds is known a clock before.
        feeds, spins, resets = Signal(), Signal(), Signal()
        change = Signal(signed(5))
        total = Signal(signed(OVERRIDE_BITS + 2))
        bounded = Signal(OVERRIDE_BITS)
        code, before = self.code, Signal(Outputs)
        (feed_reset, spindle_reset), steps = _STEPS
        m.d.sync += [
            feeds.eq(self.command & Cat(
                code == each.value for each in (feed_reset, *(step[0] for step in steps))).any()),
            spins.eq(self.command & Cat(
                code == each.value
                for each in (spindle_reset, *(step[1] for step in steps))).any()),
            resets.eq((code == feed_reset.value) | (code == spindle_reset.value)),
            self.changed.eq(feeds | spins | self.restore | (before != self.outputs)),
            before.eq(self.outputs),
        ]
        with m.Switch(code):
            for of_feed, of_spindle, by in steps:
                with m.Case(of_feed.value, of_spindle.value):
                    m.d.sync += change.eq(by)
        m.d.comb += [total.eq(Mux(spins, self.spindle, self.feed) + change),
                     bounded.eq(Mux(total < LEAST, LEAST, Mux(total > MOST, MOST, total)))]
        with m.If(resets):
            m.d.comb += bounded.eq(NORMAL)
        with m.If(feeds):
            m.d.sync += self.feed.eq(bounded)
        with m.If(spins):
            m.d.sync += self.spindle.eq(bounded)
        for which, percent in ((RealtimeCode.RAPID_RESET, NORMAL), (RealtimeCode.RAPID_HALF, 50),
                               (RealtimeCode.RAPID_QUARTER, 25)):
            with m.If(self.command & (code == which.value)):
                m.d.sync += [self.rapid.eq(percent), self.changed.eq(1)]
        with m.If(self.restore):
            m.d.sync += [self.feed.eq(NORMAL), self.rapid.eq(NORMAL), self.spindle.eq(NORMAL),
                         feeds.eq(0), spins.eq(0)]
        self._switch(m)
        return m

    def _switch(self, m: Module) -> None:
        """Switch spindle and coolant."""
        stopped = Signal()
        flooded = Signal()
        misted = Signal()
        stood = Signal()  # the hold, a clock ago
        m.d.sync += stood.eq(self.standing)
        with m.If(~self.held):
            m.d.sync += stopped.eq(0)
        with m.Elif(self.laser & self.standing & ~stood):
            m.d.sync += stopped.eq(1)
        with m.Elif(self.standing & self.command & (self.code == RealtimeCode.SPINDLE_STOP.value)):
            m.d.sync += stopped.eq(~stopped)
        program, wanted = self.program, []
        for which, switched, mine in ((RealtimeCode.FLOOD, flooded, program.flood),
                                      (RealtimeCode.MIST, misted, program.mist)):
            before = Signal(name=f"{which.name.lower()}_before")
            m.d.sync += before.eq(mine)
            on = Signal(name=f"{which.name.lower()}_on")
            wanted.append(on)
            m.d.comb += [on.eq(mine ^ (switched & (before == mine))),
                         self.outputs[which.name.lower()].eq(on & ~self.coolant_off)]
            with m.If((before != mine) | self.restore):
                m.d.sync += switched.eq(0)
            with m.Elif(self.switches & self.command & (self.code == which.value)):
                m.d.sync += switched.eq(~switched)
        off = stopped | self.spindle_off
        was_stopped = Signal()
        m.d.sync += was_stopped.eq(stopped)
        m.d.comb += [
            self.spindle_restored.eq(was_stopped & ~stopped
                           & (program.clockwise | program.counter_clockwise)),
            self.coolant.eq(Cat(wanted).any()),
            self.outputs.clockwise.eq(program.clockwise & ~off),
            self.outputs.counter_clockwise.eq(program.counter_clockwise & ~off),
        ]
