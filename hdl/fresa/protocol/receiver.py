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
    error: unsigned(1)  # its stop bit was not there, or bytes before it were lost


class UARTReceiver(wiring.Component):
    """Receives bytes, 8N1, and tells which of them are not to be trusted.

    Each bit is looked at three times, in its middle and ``spread`` clocks (a sixteenth of a bit)
    before and after, and two of three decide. So a disturbance of up to ``spread`` clocks in a bit
    changes nothing, and one that looks like a start is dropped. The middles are counted from the
    edge of the start bit.

    A byte without a stop bit is handed on with ``error``, and the next is looked for when the line
    has been high for longer than a disturbance, ``2 * spread + 1`` clocks; so it is after reset. A
    break, a line that is low for longer than a byte, is one byte 0 with ``error``. One that begins
    in the middle of a byte damages that, and is seen ten bits after its missing stop bit.

    There is room for one byte: where it has not been taken when the next is complete, the next is
    lost, and the one after that has ``error``. So nothing is missing from the stream unseen.

    A byte is there with the clock edge after the last look at its stop bit, ``9 * period +
    period // 2 + spread`` clocks after the one in which the line was first seen low.

    =======  ========================================================  ========================
    state    does                                                      next
    =======  ========================================================  ========================
    LOW      waits for the line to be high for more than a moment,     IDLE
             tells a break if it is low for ten bits
    IDLE     waits for it to be low                                    START
    START    looks at the start bit                                    DATA, or IDLE if it is 1
    DATA     looks at eight bits                                       STOP
    STOP     looks at the stop bit, and hands the byte on              IDLE, or LOW if it is 0
    FAULT    shows ``fault``, receives nothing                         stays until reset
    =======  ========================================================  ========================

    Parameters
    ----------
    period : int
        Clocks of a bit, from ``LEAST_PERIOD`` to ``MAX_PERIOD``; see :func:`bit_period`.

    Attributes
    ----------
    spread : int
        Clocks from one look at a bit to the next.

    Members
    -------
    rx : In(1)
        The line, synchronous to the clock: the two flip-flops are with those of the other pins.
    bytes : Out(stream.Signature(Received))
        Bytes received.
    framing : Out(1)
        A stop bit is missing. For a clock.
    overrun : Out(1)
        A byte is lost. For a clock.
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

        # Clocks to the last look at a bit, below 0.
        first, high = -(self.period // 2 + self.spread), -2 * self.spread
        time = Signal(range(1 - self.period, 1), init=high)
        word = Signal(8)
        looks = Signal(2)
        look = Signal()
        decide = Signal()
        bit = Signal()
        m.d.comb += [
            look.eq((time == high) | (time == -self.spread)),
            decide.eq(time >= 0),
            bit.eq(looks.all() | (self.rx & looks.any())),
        ]
        with m.If(look):
            m.d.sync += looks.eq(Cat(self.rx, looks))

        # Clocks for which it was low since it should have been high.
        low = Signal(range(10 * self.period))

        # Bits come in from the top; a 1 goes before them, and falls out when there are eight.
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
        """Keep a byte until it is taken, and remember that one was lost."""
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
