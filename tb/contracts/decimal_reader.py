"""Contract of the reader of decimal numbers."""

from amaranth import Mux

from fresa.protocol import DecimalReader, NumberError

from .contract import Case, Component, Contract

__all__ = ["DECIMAL_READER"]


def describe(c: Contract, dut: DecimalReader) -> None:
    """A number is read as sign and magnitude, and has its value or is refused."""
    width, has_sign = dut.shape.width, dut.shape.signed
    byte, end = dut.items.p.byte, dut.items.p.end
    waits = dut.numbers.valid
    number, error = dut.numbers.p.value, dut.numbers.p.error
    payload = dut.numbers.payload.as_value()
    read = dut.items.valid & dut.items.ready
    over = waits & dut.numbers.ready

    begun, some = c.keep(1, name="has_begun"), c.keep(1, name="has_digits")
    minus, large = c.keep(1, name="is_minus"), c.keep(1, name="too_large")
    magnitude = c.keep(width, name="magnitude")
    is_digit = ~end & (byte >= 0x30) & (byte <= 0x39)
    is_sign = ~end & ~begun & ((byte == 0x2B) | (byte == 0x2D)) & has_sign
    grown = magnitude * 10 + (byte - 0x30)[:4]
    limit = (2 ** (width - 1) - 1) + minus if has_sign else 2**width - 1
    with c.m.If(c.rst | over):
        c.m.d.sync += [begun.eq(0), some.eq(0), minus.eq(0), large.eq(0), magnitude.eq(0)]
    with c.m.Elif(read):
        c.m.d.sync += begun.eq(1)
        with c.m.If(is_digit):
            c.m.d.sync += [some.eq(1), magnitude.eq(grown), large.eq(large | (grown > limit))]
        with c.m.Else():
            c.m.d.sync += minus.eq(byte == 0x2D)
    exact = Mux(minus, -magnitude, magnitude)

    c.implication("digits-taken", "A digit is taken at once, and a sign where one may be.",
                  when=dut.items.valid & ~waits & (is_digit | is_sign), then=dut.items.ready)
    c.implication("rest-left-in-line", "What does not belong to the number stays in the line.",
                  when=dut.items.valid & ~is_digit & ~is_sign, then=~dut.items.ready)
    c.implication("one-at-a-time", "While a number waits nothing is taken.", when=waits,
                  then=~dut.items.ready)
    c.implication("valid-after-number", "It is valid the clock after what does not belong to it "
                  "was seen.",
                  when=c.past(dut.items.valid & ~waits & ~is_digit & ~is_sign & ~c.rst), then=waits)
    c.implication("valid-only-after-number", "And not before.", when=waits & ~c.past(waits),
                  then=c.past(dut.items.valid & ~is_digit & ~is_sign))
    c.implication("stable-until-ready", "It stays until it is taken.",
                  when=c.past(waits & ~dut.numbers.ready & ~c.rst),
                  then=waits & (payload == c.past(payload)))
    c.implication("value", "A number that fits has its value.",
                  when=waits & some & ~large, then=(error == NumberError.NONE) & (number == exact))
    c.implication("overflow", "One that does not fit is refused.", when=waits & large,
                  then=error == NumberError.OVERFLOW)
    c.implication("no-digits", "Without a digit there is none.", when=waits & ~some,
                  then=error == NumberError.NO_DIGITS)
    c.implication("restarts", "After a number was taken, and after reset, the next begins at "
                  "nothing.", when=c.past(over | c.rst),
                  then=~waits & ~c.signal("digits") & ~c.signal("begun")
                  & ~c.signal("overflow") & (c.signal("value") == 0))
    c.invariant("digits-held", "The value of the digits so far is held, as long as it fits.",
                (c.signal("digits") == some) & (c.signal("overflow") == large)
                & (large | ((c.signal("value") == exact) & (magnitude <= limit)))
                & (c.signal("begun") == begun) & (~some | begun)
                & (minus == c.signal("negative")) & (~minus | (begun & has_sign)) & (~large | some)
                & (some | (magnitude == 0)),
                cover=magnitude == 21)


DECIMAL_READER = Component(
    make=DecimalReader, describe=describe, depth=9,
    cases=(Case({"width": 6, "is_signed": True}), Case({"width": 6}),
           Case({"width": 33, "is_signed": True}, real=True), Case({"width": 32}, real=True)))
