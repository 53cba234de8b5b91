"""Contracts of the reader and the writer of hexadecimal lines.

Their CRC is watched beside a register that shifts a bit at a time, as the standard describes it.
"""

from amaranth import Array, Cat, Const, Mux

from fresa.protocol import HexReader, HexWriter
from fresa.protocol.hex_reader import CHECK, CHECK_DIGITS
from fresa.protocol.line import LineEnd

from .contract import Bits, Case, Component, Contract

__all__ = ["HEX_READER", "HEX_WRITER"]

POLYNOMIAL, RESIDUE = 0xEDB88320, 0xDEBB20E3
"""Of the CRC-32, the highest power in bit 0; and the remainder after a correct line."""


def with_digit(crc: Bits, digit: Bits) -> Bits:
    """Return the register of the CRC after a digit of four bits."""
    for bit in range(4):
        crc = (crc >> 1) ^ Mux(crc[0] ^ digit[bit], POLYNOMIAL, 0)
    return crc[:32]


def describe_reader(c: Contract, dut: HexReader) -> None:
    """Every line gives a message, which is good if the line was, and then has its digits."""
    byte, end = dut.items.p.byte, dut.items.p.end
    message = dut.messages.payload.as_value()
    value, good = dut.messages.p.value, dut.messages.p.good
    waits, longest = dut.messages.valid, dut.digits + CHECK_DIGITS
    read = dut.items.valid & dut.items.ready
    over = waits & dut.messages.ready
    ends = read & end

    digits = {ord(digit): number for number, digit in enumerate("0123456789ABCDEF")}
    is_digit = Cat(byte == code for code in digits).any()
    digit = sum((Mux(byte == code, number, 0) for code, number in digits.items()), Const(0, 4))[:4]
    count = c.keep(range(longest + 2), name="digits_so_far")
    other = c.keep(1, name="not_digits")
    crc = c.keep(32, init=0xFFFFFFFF, name="crc_so_far")
    held = [c.keep(4, name=f"digit_{place}") for place in range(dut.digits)]
    right = c.keep(1, name="line_is_right")
    with c.m.If(c.rst | over):
        c.m.d.sync += [count.eq(0), other.eq(0), crc.eq(crc.init)]
    with c.m.Elif(ends):
        c.m.d.sync += right.eq((byte == LineEnd.GOOD) & (count == longest) & ~other
                               & (crc == RESIDUE))
    with c.m.Elif(read & ~is_digit):
        c.m.d.sync += other.eq(1)
    with c.m.Elif(read & (count <= longest)):
        c.m.d.sync += count.eq(count + 1)
        with c.m.If(count < longest):
            c.m.d.sync += crc.eq(with_digit(crc, digit))
        for place, at in enumerate(held):
            with c.m.If(count == place):
                c.m.d.sync += at.eq(digit)

    # Covers look for a line that is right, but for its first digit: to find one is a long search.
    check = CHECK.compute([0xA] * dut.digits)
    line = Array([0xA] * dut.digits + [check >> 4 * place & 15 for place in range(CHECK_DIGITS)])
    c.restrict_covers(~c.rst & dut.items.valid
                      & (~is_digit | (count == 0) | (count >= longest) | (digit == line[count])))

    c.implication("answers-every-line", "A line that ends is a message with the next clock.",
                  when=c.past(ends & ~c.rst), then=waits)
    c.implication("no-other-message", "No message is offered without the end of a line.",
                  when=waits & ~c.past(waits),
                  then=c.past(ends & ~c.rst))
    c.invariant("one-at-a-time", "While a message waits nothing is read, and else all is.",
                dut.items.ready == ~waits, cover=waits)
    c.implication("stable-until-ready", "A message stays until it is taken.",
                  when=c.past(waits & ~dut.messages.ready & ~c.rst),
                  then=waits & (message == c.past(message)))
    c.implication("message-offered-once", "A message is not offered again after it was taken, nor "
                  "after a reset.", when=c.past(over | c.rst), then=~waits)
    c.implication("starts-empty", "After power-up, and after reset, no part of a message is "
                  "left.", when=~c.past(1) | c.past(c.rst), then=message == 0)
    c.implication("good-is-right", "A good message has its digits, a correct CRC, and no "
                  "other byte, and its line was complete.", when=waits & good, then=right)
    c.implication("right-is-good", "A line that has all of that gives a good message.",
                  when=waits & right,
                  then=good)
    c.implication("data-are-digits", "Good data are the digits of the line.",
                  when=waits & good,
                  then=Cat(reversed(held)) == value)
    c.invariant("items-counted", "The registers hold the number of items, and whether all were "
                "digits.",
                (c.signal("count") == Mux(count > longest, longest, count))
                & (c.signal("wrong") == (other | (count > longest)))
                & (c.signal("crc.crc_reg") == Cat(reversed(crc)))
                & Cat((place >= count) | (at == value.word_select(
                    (Mux(count > dut.digits, dut.digits, count) - 1 - place)[:8], 4))
                    for place, at in enumerate(held)).all()
                & (~waits | (good == right)),
                cover=count > longest)


HEX_READER = Component(
    make=HexReader, describe=describe_reader, depth=15,
    cases=(Case({"digits": 1}), Case({"digits": 2}), Case({"digits": 24}, real=True)))


def describe_writer(c: Contract, dut: HexWriter) -> None:
    """A message that is taken becomes its line, whole, and nothing else is sent."""
    offered, byte = dut.bytes.valid, dut.bytes.payload
    given = offered & dut.bytes.ready
    taken = dut.messages.valid & dut.messages.ready
    length = 1 + dut.digits + CHECK_DIGITS + 2

    message = c.keep(4 * dut.digits, name="message")
    sending, sent = c.keep(1, name="sending"), c.keep(range(length + 1), name="sent")
    crc = c.keep(32, init=0xFFFFFFFF, name="crc_so_far")
    digits = [message.word_select(dut.digits - 1 - place, 4) for place in range(dut.digits)]
    text = [Const(dut.start[0], 8), *map(_character, digits),
            *(_character((~crc).word_select(place, 4)) for place in range(CHECK_DIGITS)),
            Const(ord("\r"), 8), Const(ord("\n"), 8)]
    expected = Const(0, 8)
    for place, character in enumerate(text):
        expected = Mux(sent == place, character, expected)
    last = given & (sent == length - 1)
    with c.m.If(c.rst | last):
        c.m.d.sync += sending.eq(0)
    with c.m.Elif(taken):
        c.m.d.sync += [sending.eq(1), sent.eq(0), message.eq(dut.messages.payload),
                       crc.eq(crc.init)]
    with c.m.Elif(given):
        c.m.d.sync += sent.eq(sent + 1)
        for place, digit in enumerate(digits, start=1):
            with c.m.If(sent == place):
                c.m.d.sync += crc.eq(with_digit(crc, digit))

    c.implication("is-the-line", "The bytes are the start, the digits, their CRC and the end.",
                  when=offered, then=sending & (byte == expected))
    c.invariant("no-gap", "A byte is offered from the clock after the message to the last.",
                offered == sending, cover=sending)
    c.invariant("one-at-a-time", "The next message is taken when the last byte has been.",
                dut.messages.ready == ~sending, cover=sending)
    c.implication("stable-until-ready", "A byte stays until it is taken.",
                  when=c.past(offered & ~dut.bytes.ready & ~c.rst),
                  then=offered & (byte == c.past(byte)))
    c.implication("reset-ends-line", "Reset ends a line.", when=c.past(c.rst),
                  then=dut.messages.ready & ~offered)
    rest, register = c.signal("rest"), c.signal("crc.crc_reg")
    behind = Array(Cat(Const(0, 4 * held), message)[:len(rest)] for held in (
        0, *(min(place, dut.digits) for place in range(length))))
    c.implication("reset-clears", "After reset nothing is left of a line.", when=c.past(c.rst),
                  then=(rest == 0) & register.all())
    c.invariant("place-in-line", "The registers hold the rest of the line.",
                (c.signal("left") == Mux(sending, length - sent, 0)) & (~sending | (sent < length))
                & (~sending | (register == Cat(reversed(crc))))
                & (rest == Mux(sending, behind[sent], 0)),
                cover=sending & (sent == length - 1))


def _character(digit: Bits) -> Bits:
    return Mux(digit < 10, 0x30 + digit, 0x41 - 10 + digit)[:8]


HEX_WRITER = Component(
    make=HexWriter, describe=describe_writer, depth=15,
    cases=(Case({"digits": 1, "start": b"="}), Case({"digits": 2, "start": b":"}),
           Case({"digits": 22, "start": b"="}, real=True)))
