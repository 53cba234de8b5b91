"""Real-time commands of G-code senders, out of the bytes of a line."""

from amaranth import Cat, Module, Signal
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out

from .receiver import Received

__all__ = ["RealtimeCode", "RealtimeFilter"]


class RealtimeCode(enum.Enum, shape=8):
    """Real-time command: the byte that gives it, as GRBL 1.1 has it."""

    RESET = 0x18
    HOLD = ord("!")
    STATUS = ord("?")
    RESUME = ord("~")
    DOOR = 0x84
    JOG_CANCEL = 0x85
    FEED_RESET = 0x90
    FEED_PLUS_10 = 0x91
    FEED_MINUS_10 = 0x92
    FEED_PLUS_1 = 0x93
    FEED_MINUS_1 = 0x94
    RAPID_RESET = 0x95
    RAPID_HALF = 0x96
    RAPID_QUARTER = 0x97
    SPINDLE_RESET = 0x99
    SPINDLE_PLUS_10 = 0x9A
    SPINDLE_MINUS_10 = 0x9B
    SPINDLE_PLUS_1 = 0x9C
    SPINDLE_MINUS_1 = 0x9D
    SPINDLE_STOP = 0x9E
    FLOOD = 0xA0
    MIST = 0xA1


class RealtimeFilter(wiring.Component):
    """Takes real-time commands out of a stream of bytes, wherever they stand.

    They are taken at once, also while the other bytes wait; a byte from 0x80 on that is no command
    is dropped. The other bytes, and every byte with an error, whose code cannot be trusted, go on
    without delay.

    Members
    -------
    bytes : In(stream.Signature(Received))
        Bytes, each with its error flag.
    rest : Out(stream.Signature(Received))
        Those that are no commands.
    command : Out(1)
        A command came in the clock before. For one clock.
    code : Out(8)
        Which, a `RealtimeCode`, while ``command`` is 1.
    """

    bytes: In(stream.Signature(Received))
    rest: Out(stream.Signature(Received))
    command: Out(1)
    code: Out(8)

    def elaborate(self, platform) -> Module:
        m = Module()

        byte, error = self.bytes.p.byte, self.bytes.p.error
        known = Signal()
        passes = Signal()
        m.d.comb += [
            known.eq(Cat(byte == code.value for code in RealtimeCode).any()),
            passes.eq(error | ~(known | byte[7])),
            self.rest.payload.eq(self.bytes.payload),
            self.rest.valid.eq(self.bytes.valid & passes),
            self.bytes.ready.eq(self.rest.ready | ~passes),
        ]
        m.d.sync += [
            self.command.eq(self.bytes.valid & known & ~error),
            self.code.eq(byte),
        ]

        return m
