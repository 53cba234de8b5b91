"""Bytes from a serial line."""

from amaranth import Cat, Module, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..fsm import leave_unused_codes
from .baud import LEAST_PERIOD, valid_bit

__all__ = ["Received", "UARTReceiver"]


class Received(data.Struct):
    """A byte from the line."""

    byte: unsigned(8)
    error: unsigned(1)  # framing error, or bytes before it were lost


class UARTReceiver(wiring.Component):
    """Receives bytes, 8N1, and marks framing errors and lost bytes.

    Majority-votes three samples a bit: in its middle and ``spread`` clocks (a sixteenth of a bit)
    before and after. So a glitch of up to ``spread`` clocks in a bit changes nothing, and one that
    looks like a start bit is dropped. Samples are timed from the edge of the start bit.

    A byte without a stop bit (framing error) is passed on with ``error``, and the next start bit is
    accepted when the line has been high for ``2 * spread + 1`` clocks; so it is after reset. A
    break, a line that is low for longer than a byte, is one byte 0 with ``error``. One that begins
    within a byte damages that byte, and is detected ten bits after its missing stop bit.

    There is room for one byte: if it has not been taken when the next is complete, the next is
    lost, and the one after that has ``error``. So no loss goes unnoticed.

    A byte is valid one clock after the last sample of its stop bit, ``9 * period + period // 2 +
    spread`` clocks after the one in which the line was first seen low.

    =======  ========================================================  ========================
    state    does                                                      next
    =======  ========================================================  ========================
    LOW      waits until the line is high for longer than a glitch;    IDLE
             detects a break when it is low for ten bits
    IDLE     waits for it to be low                                    START
    START    samples the start bit                                     DATA, or IDLE if it is 1
    DATA     samples eight bits                                        STOP
    STOP     samples the stop bit, and passes the byte on              IDLE, or LOW if it is 0
    FAULT    shows ``fault``, receives nothing                         stays until reset
    =======  ========================================================  ========================

    Parameters
    ----------
    period : int
        Clocks of a bit, from ``LEAST_PERIOD`` to ``MAX_PERIOD``; see :func:`bit_period`.

    Attributes
    ----------
    spread : int
        Clocks from one sample of a bit to the next.

    Members
    -------
    rx : In(1)
        The line, synchronous to the clock: its synchroniser is with those of the other pins.
    bytes : Out(stream.Signature(Received))
        Bytes received.
    framing : Out(1)
        Framing error: a stop bit is missing. For one clock.
    overrun : Out(1)
        A byte is lost. For one clock.
    line_break : Out(1)
        The line has been low for longer than a byte, or for longer than two if it was not idle
        before, and not high for long enough since.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``period`` is out of range.
    """

    rx: In(1)
    bytes: Out(stream.Signature(Received))
    framing: Out(1)
    overrun: Out(1)
    line_break: Out(1)
    fault: Out(1)

    def __init__(self, *, period: int) -> None:
        self.period = valid_bit(period)
        self.spread = self.period // LEAST_PERIOD
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        # Clocks to the last sample of a bit, counted up to 0.
        first, high = -(self.period // 2 + self.spread), -2 * self.spread
        time = Signal(range(1 - self.period, 1), init=high)
        word = Signal(8)
        looks = Signal(2)
        look = Signal()
        decide = Signal()
        bit = Signal()
        m.d.comb += [
            look.eq((time == high) | (time == -self.spread)),
            decide.eq(time[-1] == 0),
            bit.eq(looks.all() | (self.rx & looks.any())),
        ]
        with m.If(look):
            m.d.sync += looks.eq(Cat(self.rx, looks))

        # Clocks for which the line has been low since the missing stop bit.
        low = Signal(range(10 * self.period))

        # Shift register, filled from the top; a marker 1 ahead of the bits falls out after eight.
        ended = Signal()
        with m.FSM(name="receiver_state") as fsm:
            with m.State("LOW"):
                m.d.sync += time.eq(high)
                with m.If(self.rx):
                    m.d.sync += time.eq(time + 1)
                    with m.If(decide):
                        m.d.sync += [self.line_break.eq(0), low.eq(0)]
                        m.next = "IDLE"
                with m.Elif(low == 10 * self.period - 1):
                    m.d.sync += self.line_break.eq(1)
                with m.Else():
                    m.d.sync += low.eq(low + 1)

            with m.State("IDLE"):
                m.d.sync += time.eq(first)
                with m.If(~self.rx):
                    m.d.sync += time.eq(first + 1)
                    m.next = "START"

            with m.State("START"):
                m.d.sync += time.eq(time + 1)
                with m.If(decide):
                    m.d.sync += [time.eq(1 - self.period), word.eq(1 << 7)]
                    m.next = "DATA"
                    with m.If(bit):
                        m.next = "IDLE"

            with m.State("DATA"):
                m.d.sync += time.eq(time + 1)
                with m.If(decide):
                    m.d.sync += [time.eq(1 - self.period), word.eq(Cat(word[1:], bit))]
                    with m.If(word[0]):
                        m.next = "STOP"

            with m.State("STOP"):
                m.d.sync += time.eq(time + 1)
                with m.If(decide):
                    m.d.comb += ended.eq(1)
                    m.d.sync += time.eq(high)
                    m.next = "IDLE"
                    with m.If(~bit):
                        m.next = "LOW"

            with m.State("FAULT"):
                pass

        m.d.comb += [
            self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT")),
            self.framing.eq(ended & ~bit),
        ]
        with m.If(ended):
            m.d.sync += self.line_break.eq(~bit & (word == 0))
        self._hand_on(m, word, ended)
        return m

    def _hand_on(self, m: Module, word: Signal, ended: Signal) -> None:
        """Hold a byte until it is taken, and note an overrun."""
        lost = Signal()
        m.d.comb += self.overrun.eq(ended & self.bytes.valid & ~self.bytes.ready)
        with m.If(self.overrun):
            m.d.sync += lost.eq(1)
        with m.Elif(ended):
            m.d.sync += [
                self.bytes.valid.eq(1),
                self.bytes.p.byte.eq(word),
                self.bytes.p.error.eq(self.framing | lost),
                lost.eq(0),
            ]
        with m.Elif(self.bytes.ready):
            m.d.sync += self.bytes.valid.eq(0)
