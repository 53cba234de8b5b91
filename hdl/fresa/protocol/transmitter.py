"""Bytes onto a serial line."""

from amaranth import Cat, Const, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..drive import FrequencyDivider
from .baud import valid_bit

__all__ = ["UARTTransmitter"]


class UARTTransmitter(wiring.Component):
    """Sends bytes, 8N1: a start bit of 0, eight bits from the lowest, a stop bit of 1.

    The start bit begins with the clock edge that takes the byte. A bit lasts ``period`` clocks and
    a byte ten bits; waiting bytes follow without a gap. ``tx`` comes straight from a flip-flop.
    Reset aborts a byte: the line is high at once.

    Parameters
    ----------
    period : int
        Clocks of a bit, from ``LEAST_PERIOD`` to ``MAX_PERIOD``; see :func:`bit_period`.

    Members
    -------
    bytes : In(stream.Signature(8))
        Bytes to send.
    tx : Out(1)
        The line.

    Raises
    ------
    ValueError
        If ``period`` is out of range.
    """

    bytes: In(stream.Signature(8))
    tx: Out(1)

    def __init__(self, *, period: int) -> None:
        self.period = valid_bit(period)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.divider = divider = FrequencyDivider(period=self.period)
        busy = Signal()
        left = Signal(range(10))  # bits after the one on the line
        word = Signal(9, init=~0)  # bit 0 is on the line; the stop bit is shifted in
        ended = Signal()
        m.d.comb += [
            divider.enable.eq(busy),
            ended.eq(divider.tick & (left == 0)),
            self.bytes.ready.eq(~busy | ended),
            self.tx.eq(word[0]),
        ]

        with m.If(divider.tick):
            m.d.sync += [word.eq(Cat(word[1:], 1)), left.eq(left - 1)]
        with m.If(ended):
            m.d.sync += busy.eq(0)
        with m.If(self.bytes.valid & self.bytes.ready):
            m.d.sync += [
                word.eq(Cat(Const(0, 1), self.bytes.payload)),
                left.eq(9),
                busy.eq(1),
            ]

        return m
