"""Messages to lines of hexadecimal digits with a check."""

from amaranth import Cat, Const, Module, Mux, Signal, unsigned
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .hex_reader import CHECK, CHECK_DIGITS, MAX_DIGITS

__all__ = ["HexWriter"]


class HexWriter(wiring.Component):
    """Writes a message as a line that a `HexReader` accepts, with CR and LF after it.

    The start of the line is valid one clock after the message was taken, and every other byte one
    clock after the one before it was taken. The next message is taken when the last byte has been.

    Parameters
    ----------
    digits : int
        Digits of a message without its check, from 1 to ``MAX_DIGITS``.
    start : bytes
        The character that starts a line.

    Members
    -------
    messages : In(stream.Signature)
        Messages, four bits for each digit, the first highest.
    bytes : Out(stream.Signature(8))
        Their lines.

    Raises
    ------
    ValueError
        If ``digits`` is out of range, or ``start`` is not one character.
    """

    def __init__(self, *, digits: int, start: bytes) -> None:
        self.digits = in_range("digits of a message", digits, 1, MAX_DIGITS)
        if not isinstance(start, bytes) or len(start) != 1:
            raise ValueError(f"a line starts with one character, not {start!r}")
        self.start = start
        super().__init__({
            "messages": In(stream.Signature(unsigned(4 * digits))),
            "bytes": Out(stream.Signature(8)),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        first = 1 + self.digits + CHECK_DIGITS + 2
        left = Signal(range(first + 1))  # bytes of the line
        rest = Signal(4 * self.digits)  # digits of the message, the next highest
        m.submodules.crc = crc = CHECK.create()
        given = Signal()
        body = Signal()
        check = Signal()
        digit = Signal(4)
        m.d.comb += [
            self.messages.ready.eq(left == 0),
            self.bytes.valid.eq(left != 0),
            given.eq(self.bytes.valid & self.bytes.ready),
            body.eq((left != first) & (left > CHECK_DIGITS + 2)),
            check.eq((left > 2) & (left <= CHECK_DIGITS + 2)),
            digit.eq(Mux(check, crc.crc.word_select((CHECK_DIGITS + 2 - left)[:3], 4),
                         rest[-4:])),
            crc.start.eq(self.messages.valid & self.messages.ready),
            crc.data.eq(digit),
            crc.valid.eq(given & body),
        ]
        with m.If(body | check):
            m.d.comb += self.bytes.payload.eq(
                Mux(digit < 10, ord("0"), ord("A") - 10) + digit)
        with m.Elif(left == 2):
            m.d.comb += self.bytes.payload.eq(ord("\r"))
        with m.Elif(left == 1):
            m.d.comb += self.bytes.payload.eq(ord("\n"))
        with m.Else():
            m.d.comb += self.bytes.payload.eq(self.start[0])

        with m.If(given):
            m.d.sync += left.eq(left - 1)
            with m.If(body):
                m.d.sync += rest.eq(Cat(Const(0, 4), rest))
        with m.If(self.messages.valid & self.messages.ready):
            m.d.sync += [left.eq(first), rest.eq(self.messages.payload)]

        return m
