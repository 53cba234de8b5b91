"""Contract of the writer of decimal numbers."""

from amaranth import Array, Mux

from fresa.protocol import DecimalWriter

from .contract import Bits, Case, Component, Contract

__all__ = ["DECIMAL_WRITER"]

WATCHED = 8
"""Most bits of a number whose digits are put together again; more bits only lengthen the sum."""


def describe(c: Contract, dut: DecimalWriter) -> None:
    """The digits written are those of the number, and no more than it takes."""
    state = c.state("writer_state")
    left, place, digit = (c.signal(name) for name in ("left", "place", "digit"))
    power = Array(10**n for n in range(dut.digits))[place]
    byte = dut.bytes.payload
    taken = dut.numbers.valid & dut.numbers.ready
    given = dut.bytes.valid & dut.bytes.ready

    number = c.keep(dut.shape, name="number")
    offered = c.keep(range(dut.digits + 2), name="offered")  # bytes of it that were taken
    with c.m.If(taken | c.rst):
        c.m.d.sync += [number.eq(dut.numbers.payload), offered.eq(0)]
    with c.m.Elif(given & (byte != ord("."))):
        c.m.d.sync += offered.eq(offered + 1)
    minus = number < 0
    point = ["POINT"] if dut.most_decimals else []
    writes = state("COUNT", "DIGIT", *point)
    busy = state("COUNT", "DIGIT", *point, *(["SIGN"] if dut.shape.signed else []))
    last = state("DIGIT") & (place == 0)
    digits = offered - minus  # taken so far, once the sign is
    decimals = _watch_point(c, dut, digits, place) if dut.most_decimals else 0
    needed = place <= decimals  # even if it is a 0

    c.implication("ready-at-rest", "A number is taken at rest, and only there.",
                  when=state("REST") | dut.numbers.ready, then=state("REST") & dut.numbers.ready)
    c.implication("stable-until-ready", "A byte that is offered stays until it is taken.",
                  when=c.past(dut.bytes.valid & ~dut.bytes.ready & ~c.rst),
                  then=dut.bytes.valid & (byte == c.past(byte)))
    c.implication("digits-only", "Behind the sign each byte is a digit, or the point.",
                  when=dut.bytes.valid & ((offered > 0) | ~minus),
                  then=((byte >= 0x30) & (byte <= 0x39)) | state(*point))
    if dut.shape.signed:
        c.implication("sign-first", "A negative number begins with its sign.",
                      when=dut.bytes.valid & minus & (offered == 0), then=byte == ord("-"))
        c.implication("sign-is-there", "The sign is taken before its digits are counted.",
                      when=state("COUNT", "DIGIT") & minus, then=offered > 0)
        c.implication("sign-before-digits", "Until the sign is taken nothing is counted.",
                      when=state("SIGN"), then=minus & (offered == 0)
                      & (c.signal("shown") == needed)
                      & (digit == 0) & (place == dut.digits - 1) & (left == number.as_unsigned()))
    c.implication("no-sign", "No other number has one.", when=dut.bytes.valid & ~minus,
                  then=byte != ord("-"))
    c.implication("no-leading-zero", "The first digit is no 0 unless it is the only one, or stands "
                  "before the point.", when=dut.bytes.valid & (digits == 0) & (byte == 0x30),
                  then=place == decimals)
    c.implication("rest-after-last-digit", "After the last digit the next number can be taken.",
                  when=c.past(last & given), then=state("REST"))
    c.implication("busy-until-last-digit", "And not before.",
                  when=c.past(busy & ~(last & given) & ~c.rst),
                  then=~state("REST"))
    c.implication("reset-clears", "Reset ends it.", when=c.past(c.rst), then=state("REST"))
    c.implication("digit-fits", "The remainder fits into the digits still to come.",
                  when=writes, then=(place < dut.digits) & (digit <= 9)
                  & (left < power * (10 - digit)) & (~state("DIGIT") | (left < power)))
    counted = state("COUNT") & (left >= power)
    c.implication("count-subtracts", "What the digit counts is taken away.",
                  when=c.past(counted & ~c.rst),
                  then=(left == c.past((left - power)[:len(left)])) & (digit == c.past(digit + 1)))
    c.implication("count-only-subtracts", "Nothing else is, and no other digit is begun.",
                  when=c.past(writes & ~counted & ~c.rst) & writes,
                  then=(left == c.past(left)) & (digit == Mux(c.past(given), 0, c.past(digit))))
    c.implication("all-digits-sent", "The remainder starts as the absolute value.",
                  when=~c.past(writes) & state("COUNT"),
                  then=left == Mux(minus, -number, number)[:len(left)])
    c.implication("remainder-bounded", "The remainder never exceeds that.",
                  when=writes, then=left <= Mux(minus, -number,
                                                                 number)[:len(left)])
    c.implication("written-counts", "The state agrees with whether a digit was written, or has to "
                  "be.", when=writes, then=(digits + place < dut.digits)
                  & (c.signal("shown") == ((digits > 0) | needed)))
    c.invariant("power", "The power of ten is that of the place.",
                ~busy | (c.signal("power") == Mux(writes, power, 1)), cover=writes, lemma=True)
    if dut.most_decimals:
        c.implication("point-before-decimals", "The point stands before the decimals.",
                      when=state("POINT"), then=(byte == ord(".")) & (digits > 0)
                      & (place + 1 == decimals) & (digit == 0))
    if dut.shape.width <= WATCHED:
        _watch_value(c, dut, number, given, last, power, writes)
    c.leaves_unused_codes("writer_state", fault=dut.fault,
                          shows=~dut.bytes.valid & ~dut.numbers.ready)


def _watch_point(c: Contract, dut: DecimalWriter, digits: Bits, place: Bits) -> Bits:
    """State that the point is written once or not at all; return the decimals that are wanted."""
    state = c.state("writer_state")
    before = ["POINT", *(["SIGN"] if dut.shape.signed else [])]
    wanted = c.keep(range(dut.most_decimals + 1), name="wanted")
    c.assume(dut.decimals <= dut.most_decimals)
    there = c.keep(1, name="there")
    with c.m.If(dut.numbers.ready | c.rst):
        c.m.d.sync += [wanted.eq(dut.decimals), there.eq(0)]
    with c.m.Elif(dut.bytes.ready & state("POINT")):
        c.m.d.sync += there.eq(1)
    c.invariant("most-decimals", "There are no more than it may have.",
                wanted <= dut.most_decimals, cover=wanted == dut.most_decimals, lemma=True)
    c.implication("point-once", "A number that is to have a point has one before its decimals, "
                  "and no other has any.", when=state("COUNT", "DIGIT"),
                  then=there == (place < wanted))
    c.implication("point-kept", "Where it has one is sampled with the number.",
                  when=~dut.numbers.ready & ~state("FAULT"),
                  then=(c.signal("decimals") == wanted) & (~state(*before) | ~there)
                  & (~state("COUNT", "DIGIT") | (place >= wanted) | (digits > 0)))
    return wanted


def _watch_value(c: Contract, dut: DecimalWriter, number: Bits, given: Bits, last: Bits,
                 power: Bits, writes: Bits) -> None:
    """State that the digits, put together again, are the number."""
    state, byte = c.state("writer_state"), dut.bytes.payload
    so_far = c.keep(dut.shape.width, name="so_far")
    shown = (so_far * 10 + byte[:4])[:dut.shape.width]
    with c.m.If(dut.numbers.ready | c.rst):
        c.m.d.sync += so_far.eq(0)
    with c.m.Elif(given & (byte != ord("-")) & (byte != ord("."))):
        c.m.d.sync += so_far.eq(shown)
    magnitude = Mux(number < 0, -number, number)[:dut.shape.width]

    c.implication("digits-are-the-number", "The digits are those of the number, its sign aside.",
                  when=last & given, then=shown == magnitude)
    c.implication("digits-and-remainder", "The digits so far, the one that is counted and what "
                  "is left are all of it.", when=writes,
                  then=so_far * power * 10 + c.signal("digit") * power
                  + c.signal("left") == magnitude)
    c.invariant("empty-at-rest", "At rest nothing of the next number is written.",
                ~state("REST", *(["SIGN"] if dut.shape.signed else [])) | (so_far == 0)
                | (state("REST") & c.past(given)), cover=so_far != 0)


DECIMAL_WRITER = Component(
    make=DecimalWriter, describe=describe, depth=30,
    cases=(Case({"width": 7, "is_signed": True}), Case({"width": 5}),
           Case({"width": 7, "is_signed": True, "most_decimals": 1}),
           Case({"width": 9, "is_signed": True, "most_decimals": 2}),
           Case({"width": 32, "is_signed": True}, real=True), Case({"width": 32}, real=True),
           Case({"width": 28, "is_signed": True, "most_decimals": 4}, real=True),
           Case({"width": 7, "is_signed": True}, upset=True),
           Case({"width": 7, "is_signed": True, "most_decimals": 1}, upset=True)))
