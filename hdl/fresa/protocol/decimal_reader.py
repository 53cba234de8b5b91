"""Decimal digits to numbers."""

from amaranth import Cat, Module, Mux, Shape, Signal, signed, unsigned
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .line import LineItem

__all__ = ["DecimalReader", "NumberError", "number_shape"]


class NumberError(enum.Enum, shape=unsigned(2)):
    """Error of a number."""

    NONE = 0
    NO_DIGITS = 1
    OVERFLOW = 2  # it does not fit into the bits of a number


def number_shape(width: object, is_signed: bool) -> Shape:
    """Return the shape of a number of `width` bits, from 5 to 33, else raise ValueError."""
    width = in_range("width of a number", width, 5, 33)
    return signed(width) if is_signed else unsigned(width)


class DecimalReader(wiring.Component):
    """Reads a decimal number: digits, after a sign if signs are enabled.

    It takes bytes from a line as long as they belong to the number, one a clock. The first that
    does not, another byte or the end of the line, stays in the stream for the next reader, and the
    number is valid one clock after it was seen. While a number waits to be taken nothing is read;
    offer the line to this reader only when a number is expected.

    Leading zeros are skipped, ``-0`` is 0. A number that does not fit is read to its end.

    Parameters
    ----------
    width : int
        Bits of a number, from 5 to 33.
    is_signed : bool
        A ``-`` or ``+`` may come before the digits.

    Members
    -------
    items : In(stream.Signature(LineItem))
        A line.
    numbers : Out(stream.Signature)
        ``value``, undefined if there is an error, and ``error``, a `NumberError`.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int = 32, is_signed: bool = False) -> None:
        self.shape = number_shape(width, is_signed)
        super().__init__({
            "items": In(stream.Signature(LineItem)),
            "numbers": Out(stream.Signature(
                data.StructLayout({"value": self.shape, "error": NumberError}))),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        byte = self.items.p.byte
        value = Signal(self.shape)
        begun = Signal()  # a sign or a digit was read
        negative = Signal()
        digits = Signal()  # at least one digit was read
        overflow = Signal()

        is_digit = Signal()
        is_sign = Signal()
        m.d.comb += is_digit.eq(~self.items.p.end & byte.matches("0011 0---", "0011 100-"))
        if self.shape.signed:
            m.d.comb += is_sign.eq(
                ~self.items.p.end & ~begun & ((byte == ord("-")) | (byte == ord("+"))))

        # A negative number accumulates downwards, so the lowest one needs no special case: less a
        # digit is its bits inverted and 1, which has place in the lowest bit of the double.
        double = Cat(negative, value)
        if self.shape.signed:
            double = double.as_signed()
        digit = Cat(byte[:4] ^ negative.replicate(4), negative).as_signed()
        more = Signal(signed(self.shape.width + 5))
        m.d.comb += [
            more.eq((value << 3) + double + digit),
            self.items.ready.eq(~self.numbers.valid & (is_digit | is_sign)),
            self.numbers.p.value.eq(value),
            self.numbers.p.error.eq(Mux(overflow, NumberError.OVERFLOW,
                                        Mux(digits, NumberError.NONE, NumberError.NO_DIGITS))),
        ]

        with m.If(self.items.valid & self.items.ready):
            m.d.sync += begun.eq(1)
            with m.If(is_sign):
                m.d.sync += negative.eq(byte == ord("-"))
            with m.Else():
                m.d.sync += [
                    digits.eq(1),
                    value.eq(more),
                    overflow.eq(overflow | (more != more[:self.shape.width].as_signed())
                                if self.shape.signed else
                                overflow | more[self.shape.width:].any()),
                ]
        with m.Elif(self.items.valid & ~self.numbers.valid):
            m.d.sync += self.numbers.valid.eq(1)
        with m.If(self.numbers.valid & self.numbers.ready):
            m.d.sync += [
                self.numbers.valid.eq(0), value.eq(0), begun.eq(0), negative.eq(0), digits.eq(0),
                overflow.eq(0),
            ]

        return m
