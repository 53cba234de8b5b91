"""Numbers to decimal digits."""

from amaranth import Array, Module, Signal, Value, signed
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .decimal_reader import number_shape

__all__ = ["DecimalWriter"]


class DecimalWriter(wiring.Component):
    """Writes a number in decimal, with a ``-`` if it is negative and without leading zeros.

    Repeated subtraction replaces division: the number of times that a power of ten fits is the
    digit, then follows the next smaller power. A digit takes at most 11 clocks, one for its byte.

    ======  ================================================================  ====================
    state   does                                                              next
    ======  ================================================================  ====================
    REST    waits for a number                                                SIGN or COUNT
    SIGN    offers the ``-``, and makes it positive; only if it is signed     COUNT
    COUNT   takes the power away and counts, or passes over a leading zero    DIGIT if it is too
                                                                              large
    DIGIT   offers the digit                                                  COUNT, POINT, or REST
                                                                              after the last
    POINT   offers the ``.``; only if there can be decimals                   COUNT
    FAULT   shows ``fault``, offers nothing                                   stays until reset
    ======  ================================================================  ====================

    Parameters
    ----------
    width : int
        Bits of a number, from 5 to 32.
    is_signed : bool
        It may be negative.
    most_decimals : int
        Most decimals that a number has, less than digits of the largest; 0 if none has any.

    Members
    -------
    numbers : In(stream.Signature)
        Numbers to write.
    decimals : In(range(most_decimals + 1))
        Write the number that is taken with a point before so many of its digits, and at least a
        digit before the point; 0 for no point. Only if ``most_decimals`` is not 0.
    bytes : Out(stream.Signature(8))
        Their bytes.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``width`` or ``most_decimals`` is out of range.
    """

    def __init__(self, *, width: int = 32, is_signed: bool = False, most_decimals: int = 0
                 ) -> None:
        self.shape = number_shape(in_range("width of a number", width, 5, 32), is_signed)
        self.digits = len(str(2 ** (width - is_signed) - (not is_signed)))
        self.most_decimals = in_range("most_decimals", most_decimals, 0, self.digits - 1)
        super().__init__({
            "numbers": In(stream.Signature(self.shape)),
            **({"decimals": In(range(most_decimals + 1))} if most_decimals else {}),
            "bytes": Out(stream.Signature(8)),
            "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        first = self.digits - 1
        left = Signal(self.shape.width)  # of the number without its sign
        place = Signal(range(self.digits))
        power = Signal(self.shape.width)  # of ten, of that place; 1 while a sign is to go
        digit = Signal(range(10))
        shown = Signal()  # the digit, even if it is a leading zero: one is written, or it is needed
        after = Signal(signed(self.shape.width + 1))
        m.d.comb += after.eq(left - power)
        decimals = None
        needs_next = place == 1  # a digit at the next place
        if self.most_decimals:
            decimals = Signal.like(self.decimals)
            needs_next = place <= decimals + 1

        def pass_place() -> None:
            m.d.sync += [place.eq(place - 1),
                         power.eq(Array([0, *(10**n for n in range(first))])[place])]

        with m.FSM(name="writer_state") as fsm:
            with m.State("REST"):
                m.d.comb += self.numbers.ready.eq(1)
                m.d.sync += [
                    left.eq(self.numbers.payload),
                    place.eq(first),
                    power.eq(10**first),
                    digit.eq(0),
                    shown.eq(0),
                ]
                if decimals is not None:
                    m.d.sync += decimals.eq(self.decimals)
                    if self.most_decimals == first:
                        m.d.sync += shown.eq(self.decimals == first)
                with m.If(self.numbers.valid):
                    m.next = "COUNT"
                    if self.shape.signed:
                        with m.If(self.numbers.payload[-1]):
                            m.d.sync += power.eq(1)
                            m.next = "SIGN"

            if self.shape.signed:
                with m.State("SIGN"):
                    m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(ord("-"))]
                    with m.If(self.bytes.ready):
                        # -x is ~(x - 1), so that the digits' own subtraction serves.
                        m.d.sync += [left.eq(~after), power.eq(10**first)]
                        m.next = "COUNT"

            with m.State("COUNT"):
                with m.If(~Value.cast(after[-1])):
                    m.d.sync += [left.eq(after), digit.eq(digit + 1)]
                with m.Elif((digit != 0) | shown):
                    m.next = "DIGIT"
                with m.Else():
                    pass_place()
                    m.d.sync += shown.eq(needs_next)

            with m.State("DIGIT"):
                m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(ord("0") | digit)]
                with m.If(self.bytes.ready):
                    pass_place()
                    m.d.sync += [digit.eq(0), shown.eq(1)]
                    m.next = "COUNT"
                    with m.If(place == 0):
                        m.next = "REST"
                    if decimals is not None:
                        with m.Elif(place == decimals):
                            m.next = "POINT"

            if self.most_decimals:
                with m.State("POINT"):
                    m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(ord("."))]
                    with m.If(self.bytes.ready):
                        m.next = "COUNT"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
