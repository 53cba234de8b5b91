"""Contract of the transmitter of a serial line."""

from amaranth import Cat, Const

from fresa.protocol import UARTTransmitter

from .contract import Case, Component, Contract

__all__ = ["UART_TRANSMITTER"]


def describe(c: Contract, dut: UARTTransmitter) -> None:
    """A byte that is taken is ten bits on the line, each as long as the others."""
    taken = dut.bytes.valid & dut.bytes.ready
    sending = c.keep(1, name="sending")
    sent = c.keep(8, name="sent")
    bit = c.keep(range(10), name="bit")  # on the line, and for how many clocks already
    clock = c.keep(range(dut.period), name="clock")
    ended = sending & (bit == 9) & (clock == dut.period - 1)
    with c.m.If(c.rst):
        c.m.d.sync += [sending.eq(0), bit.eq(0), clock.eq(0)]
    with c.m.Elif(taken):
        c.m.d.sync += [sending.eq(1), sent.eq(dut.bytes.payload), bit.eq(0), clock.eq(0)]
    with c.m.Elif(ended):
        c.m.d.sync += [sending.eq(0), bit.eq(0), clock.eq(0)]
    with c.m.Elif(sending):
        c.m.d.sync += clock.eq(clock + 1)
        with c.m.If(clock == dut.period - 1):
            c.m.d.sync += [clock.eq(0), bit.eq(bit + 1)]
    # The quickest way to every bit, with a reset in the second clock.
    c.restrict_covers(dut.bytes.valid & (c.rst == c.past(~c.past(1))))

    c.implication("idle-is-high", "Between bytes the line is high.", when=~sending, then=dut.tx)
    c.implication("start-bit", "The clock after a byte is taken has its start bit on the line.",
                  when=c.past(taken & ~c.rst), then=~dut.tx)
    c.implication("data-bits", "The eight data bits follow, the lowest first.",
                  when=sending & (bit >= 1) & (bit <= 8), then=dut.tx == (sent >> (bit - 1)[:3])[0])
    c.implication("stop-bit", "The tenth bit is a 1.", when=sending & (bit == 9), then=dut.tx)
    c.implication("bits-last", "A level changes only where a bit ends, or with reset.",
                  when=dut.tx != c.past(dut.tx, init=1), then=(clock == 0) | c.past(c.rst))
    c.implication("ready-when-idle", "A byte is taken at once while none is sent.", when=~sending,
                  then=dut.bytes.ready)
    c.implication("no-gap", "In the last clock of a stop bit the next byte can be taken.",
                  when=ended, then=dut.bytes.ready)
    c.implication("whole-bytes", "No byte is taken before the one on the line is sent.",
                  when=sending & ~ended, then=~dut.bytes.ready)
    c.implication("reset-ends-byte", "Reset makes the line high, and drops the byte.",
                  when=c.past(c.rst), then=dut.tx & dut.bytes.ready)
    c.invariant("bits-in-time", "The registers hold the bit on the line, and its clocks.",
                (c.signal("busy") == sending)
                & (c.signal("divider.count") + dut.period - 1 == clock)
                & (~sending | (c.signal("left") == 9 - bit))
                & (clock < dut.period) & (bit < 10) & (sending | ((clock == 0) & (bit == 0))),
                cover=bit == 1)
    c.invariant("word-is-bits-left", "The word is the bits still to be sent, and ones.",
                c.signal("word") == ((Cat(Const(0, 1), sent, Const(-1, 10)) >> bit)
                                     | ~sending.replicate(9))[:9], cover=bit == 1)


UART_TRANSMITTER = Component(
    make=UARTTransmitter, describe=describe, depth=166,
    cases=(Case({"period": 16}), Case({"period": 5208}, real=True)))
