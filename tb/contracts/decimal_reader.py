"""Contract of the reader of decimal numbers."""

from amaranth import Mux

from fresa.protocol import DecimalReader, NumberError, decimal_reader

from .contract import Bug, Case, Component, Contract

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

    c.holds("takes-what-belongs", "A digit is taken at once, and a sign where one may be.",
            when=dut.items.valid & ~waits & (is_digit | is_sign), then=dut.items.ready,
            bug=Bug(decimal_reader, '(byte <= ord("9"))', '(byte < ord("9"))'))
    c.holds("leaves-the-rest", "What does not belong to the number stays in the line.",
            when=dut.items.valid & ~is_digit & ~is_sign, then=~dut.items.ready,
            bug=Bug(decimal_reader, '(byte <= ord("9"))', '(byte <= ord(":"))'))
    c.holds("one-at-a-time", "While a number waits nothing is taken.", when=waits,
            then=~dut.items.ready,
            bug=Bug(decimal_reader, "~self.numbers.valid & (is_digit | is_sign)",
                    "(is_digit | is_sign)"))
    c.holds("ends", "It is there with the clock after what does not belong to it was seen.",
            when=c.past(dut.items.valid & ~waits & ~is_digit & ~is_sign & ~c.rst), then=waits,
            bug=Bug(decimal_reader, "self.numbers.valid.eq(1)", "self.numbers.valid.eq(begun)"))
    c.holds("not-before", "And not before.", when=waits & ~c.past(waits),
            then=c.past(dut.items.valid & ~is_digit & ~is_sign),
            bug=Bug(decimal_reader, "with m.Elif(self.items.valid & ~self.numbers.valid):",
                    "with m.Elif(~self.numbers.valid):"))
    c.holds("stream-keeps", "It stays until it is taken.",
            when=c.past(waits & ~dut.numbers.ready & ~c.rst),
            then=waits & (payload == c.past(payload)),
            bug=Bug(decimal_reader, "self.numbers.valid & self.numbers.ready",
                    "self.numbers.valid"))
    c.holds("value", "A number that fits has its value.",
            when=waits & some & ~large, then=(error == NumberError.NONE) & (number == exact),
            bug=Bug(decimal_reader, "(value << 3) + (value << 1)", "(value << 3) + value"))
    c.holds("overflow", "One that does not fit is refused.", when=waits & large,
            then=error == NumberError.OVERFLOW,
            bug=Bug(decimal_reader, "overflow | more[self.shape.width:].any()",
                    "overflow | more[self.shape.width]") if not has_sign else
            Bug(decimal_reader, "overflow | (more !=", "(more !="))
    c.holds("no-digits", "Without a digit there is none.", when=waits & ~some,
            then=error == NumberError.NO_DIGITS,
            bug=Bug(decimal_reader, "Mux(digits,", "Mux(begun,") if has_sign else
            Bug(decimal_reader, "digits = Signal()", "digits = Signal(init=1)"))
    c.holds("begins-anew", "After a number was taken, and after reset, the next begins at nothing.",
            when=c.past(over | c.rst), then=~waits & ~c.signal("digits") & ~c.signal("begun")
            & ~c.signal("overflow") & (c.signal("value") == 0),
            bug=Bug(decimal_reader, "overflow.eq(0),", "overflow.eq(overflow),"))
    c.always("knows-the-number", "What was read so far is known, as long as it fits.",
             (c.signal("digits") == some) & (c.signal("overflow") == large)
             & (large | ((c.signal("value") == exact) & (magnitude <= limit)))
             & (c.signal("begun") == begun) & (~some | begun)
             & (minus == c.signal("negative")) & (~minus | (begun & has_sign)) & (~large | some)
             & (some | (magnitude == 0)),
             seen=magnitude == 21, bug=Bug(decimal_reader, "digits.eq(1)", "digits.eq(~negative)"
                                          if has_sign else "digits.eq(0)"))


DECIMAL_READER = Component(
    make=DecimalReader, describe=describe, depth=9,
    cases=(Case({"width": 6, "is_signed": True}), Case({"width": 6}),
           Case({"width": 32, "is_signed": True}, real=True), Case({"width": 32}, real=True)))
