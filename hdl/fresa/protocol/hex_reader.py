"""Lines of hexadecimal digits with a check, to messages."""

from amaranth import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.crc import catalog
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .line import LineEnd, LineItem

__all__ = ["CHECK", "CHECK_DIGITS", "MAX_DIGITS", "HexReader"]

CHECK = catalog.CRC32_ISO_HDLC(data_width=4)
"""The check: the CRC-32 of Ethernet and zlib, over digits of four bits, each from its lowest."""

CHECK_DIGITS = 8

MAX_DIGITS = 64
"""Largest number of digits of a message: they are kept in flip-flops."""


class HexReader(wiring.Component):
    """Reads lines of hexadecimal digits with a CRC, and marks those without error.

    A message is ``digits`` digits from the highest, then the 8 digits of its CRC-32 from the
    lowest. Each digit, including those of the CRC, goes through the CRC as it comes; after a line
    without error its register holds a constant residue. Digits are capitals.

    Every line gives one message; that of a line that is damaged, too long or too short, or has
    other characters is not ``good``. The message is valid one clock after the end of its line was
    taken. While it waits nothing is read.

    Parameters
    ----------
    digits : int
        Digits of a message without its check, from 1 to ``MAX_DIGITS``.

    Members
    -------
    items : In(stream.Signature(LineItem))
        Lines.
    messages : Out(stream.Signature)
        ``value``, four bits for each digit, the first highest, undefined unless ``good``.

    Raises
    ------
    ValueError
        If ``digits`` is out of range.
    """

    def __init__(self, *, digits: int) -> None:
        self.digits = in_range("digits of a message", digits, 1, MAX_DIGITS)
        super().__init__({
            "items": In(stream.Signature(LineItem)),
            "messages": Out(stream.Signature(
                data.StructLayout({"value": unsigned(4 * digits), "good": 1}))),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        byte, end = self.items.p.byte, self.items.p.end
        number = Signal()
        letter = Signal()
        m.submodules.crc = crc = CHECK.create()
        m.d.comb += [
            number.eq((byte >= ord("0")) & (byte <= ord("9"))),
            letter.eq((byte >= ord("A")) & (byte <= ord("F"))),
            crc.data.eq(Mux(letter, byte[:3] + 9, byte[:4])),
        ]

        longest = self.digits + CHECK_DIGITS
        count = Signal(range(longest + 1))
        wrong = Signal()  # another character, or a digit too many
        value = self.messages.p.value
        m.d.comb += self.items.ready.eq(~self.messages.valid)
        with m.If(self.items.valid & self.items.ready):
            with m.If(end):
                m.d.sync += [
                    self.messages.valid.eq(1),
                    self.messages.p.good.eq((byte == LineEnd.GOOD) & (count == longest) & ~wrong
                                            & crc.match_detected),
                ]
            with m.Elif((number | letter) & (count != longest)):
                m.d.comb += crc.valid.eq(1)
                m.d.sync += count.eq(count + 1)
                with m.If(count < self.digits):
                    m.d.sync += value.eq(Cat(crc.data, value))
            with m.Else():
                m.d.sync += wrong.eq(1)
        with m.If(self.messages.valid & self.messages.ready):
            m.d.comb += crc.start.eq(1)
            m.d.sync += [self.messages.valid.eq(0), count.eq(0), wrong.eq(0)]

        return m
