"""Contract of the source of texts."""

from amaranth import Array, Cat

from fresa.protocol import TextSource

from .contract import Case, Component, Contract

__all__ = ["TEXT"]


def describe(c: Contract, dut: TextSource) -> None:
    """A number that is taken sends its text, whole, and nothing else."""
    offered, byte = dut.bytes.valid, dut.bytes.payload
    taken = dut.numbers.valid & dut.numbers.ready
    there = taken & (dut.numbers.payload < len(dut.texts))
    given = offered & dut.bytes.ready
    longest = max(map(len, dut.texts))

    number = c.keep(range(len(dut.texts)), name="number")
    sent = c.keep(range(longest + 1), name="sent")
    length = Array(map(len, dut.texts))[number]
    expected = Array(Array(words.ljust(longest, b"\0")) for words in dut.texts)[number][sent]
    sending = c.keep(1, name="sending")
    last = given & (sent + 1 == length)
    with c.m.If(c.rst | last):
        c.m.d.sync += [sending.eq(0), sent.eq(0)]
    with c.m.Elif(there):
        c.m.d.sync += [sending.eq(1), number.eq(dut.numbers.payload), sent.eq(0)]
    with c.m.Elif(given):
        c.m.d.sync += sent.eq(sent + 1)

    c.implication("is-the-text", "The bytes are those of the text, in their order.", when=offered,
                  then=sending & (byte == expected))
    c.implication("no-gap", "The first byte is offered two clocks after the number, another in "
                  "every clock.",
                  when=c.past(sending & ~last & ~c.rst), then=offered)
    c.implication("whole", "The next number is taken after the last byte, and not before.",
                  when=sending | dut.numbers.ready, then=sending ^ dut.numbers.ready)
    c.implication("stable-until-ready", "A byte that is offered stays until it is taken.",
                  when=c.past(offered & ~dut.bytes.ready & ~c.rst),
                  then=offered & (byte == c.past(byte)))
    c.implication("no-such-text", "A number without a text sends nothing.",
                  when=c.past(taken & ~there),
                  then=dut.numbers.ready & ~offered)
    c.implication("reset-ends-text", "Reset ends a text.", when=c.past(c.rst),
                  then=dut.numbers.ready & ~offered)
    start = Array(sum(map(len, dut.texts[:which])) for which in range(len(dut.texts)))[number]
    c.invariant("address-of-next-byte", "The address is that of the next byte.",
                Cat(c.signal("busy") == sending, ~sending | (c.signal("place") == start + sent),
                    ~sending | (sent < length), ~sending | (number < len(dut.texts)),
                    sending | ~offered).all(), cover=sent == longest - 1)


TEXT = Component(
    make=TextSource, describe=describe, depth=12,
    cases=(Case({"texts": (b"ok\r\n", b"?", b"err")}),
           Case({"texts": (b"ok\r\n", b"err command\r\n", b"err number\r\n", b"err range\r\n",
                           b"err length\r\n")}, real=True)))
