"""Digits to fixed-point numbers."""

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["WHOLE", "FixedPoint", "fixed_point_format", "fixed_point_layout"]

WHOLE = 24
"""Bits of the whole part beside the value: enough for every line number of GRBL."""

ALL = (1 << WHOLE) - 1


def fixed_point_layout(width: int) -> data.StructLayout:
    """Return the layout of a number whose value has `width` bits.

    ==========  ==================================================================
    member      is
    ==========  ==================================================================
    value       the number, in units of its last decimal; undefined with `overflow`
    overflow    it does not fit
    whole       whole part without its sign; all ones if it is that or more
    hundredths  first two decimals, from 0 to 99
    exact       nothing but zeros follows these
    integer     nothing but zeros follows the whole part
    ==========  ==================================================================
    """
    return data.StructLayout({"value": signed(width), "overflow": 1, "whole": WHOLE,
                              "hundredths": 7, "exact": 1, "integer": 1})


def fixed_point_format(width: object, decimals: object) -> tuple[int, int]:
    """Return bits of a value, from 8 to 64, and decimals, from 2 to 9, else raise ValueError."""
    return (in_range("width of a value", width, 8, 64),
            in_range("decimals of a value", decimals, 2, 9))


class FixedPoint(wiring.Component):
    """Accumulates the digits of a decimal number as an integer, in units of its last decimal.

    The first digit beyond the last decimal rounds, half away from zero; the others change nothing
    but ``exact`` and ``integer``. To ``finish``, decimals that the number lacks are added, one a
    clock, and a clock later a negative number changes its sign.

    With ``short`` a value has half as many decimals.

    One adder does all of it, a clock after its operation is chosen: ten times the value and a
    digit, the value and 1, or its negative.

    Parameters
    ----------
    width : int
        Bits of a value, from 8 to 64. Its magnitude is below ``2**(width - 1)``.
    decimals : int
        Decimals of a value, from 2 to 9.

    Members
    -------
    clear : In(1)
        A number begins; it comes before its first digit, by a clock at least.
    take : In(1)
        ``digit`` is the next digit.
    digit : In(4)
        From 0 to 9.
    decimal : In(1)
        It stands behind the point; stays 1 until ``clear``.
    short : In(1)
        The value has ``decimals // 2`` decimals; constant from the first digit to the end.
    negative : In(1)
        There is a minus sign; is constant while ``finish`` is 1.
    finish : In(1)
        The number has ended. Stays 1 until it is done, without ``take`` and ``clear``.
    done : Out(1)
        ``number`` is complete from the next clock on, until ``clear``.
    number : Out(fixed_point_layout(width))
        The number.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int = 44, decimals: int = 6) -> None:
        self.width, self.decimals = fixed_point_format(width, decimals)
        super().__init__({
            "clear": In(1), "take": In(1), "digit": In(4), "decimal": In(1), "short": In(1),
            "negative": In(1), "finish": In(1), "done": Out(1),
            "number": Out(fixed_point_layout(width)),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        value = Signal(self.width)
        whole = Signal(WHOLE, init=ALL)  # so that a reset sets it, as what is too large does
        hundredths = Signal(7)
        rest = Signal()  # not zero behind two decimals
        fraction = Signal()  # not zero behind the point
        overflow = Signal()
        m.d.comb += [
            self.number.value.eq(value), self.number.whole.eq(whole),
            self.number.overflow.eq(overflow), self.number.hundredths.eq(hundredths),
            self.number.exact.eq(~rest), self.number.integer.eq(~fraction),
        ]

        places = Signal(range(self.decimals + 2))  # decimals so far, and one that rounds
        short = self.decimals // 2
        lacks, rounds = Signal(), Signal()  # a decimal; the next one rounds
        m.d.comb += [lacks.eq(Mux(self.short, places < short, places < self.decimals)),
                     rounds.eq(Mux(self.short, places == short, places == self.decimals))]
        turned = Signal()  # a negative value has its sign
        adds = Signal()  # an operation is chosen
        grows = Signal()  # of ten times the value
        turns = Signal()  # of its negative
        first = Signal()  # the first behind the whole part
        step = Signal(4)
        m.d.comb += self.done.eq(self.finish & ~lacks & (turned | ~self.negative))
        m.d.sync += [adds.eq(0), grows.eq(~(self.take & self.decimal) | lacks), turns.eq(0),
                     first.eq((places == 0) & (self.decimal | self.finish)), step.eq(self.digit)]
        with m.If(self.finish):
            m.d.sync += [step.eq(~lacks), grows.eq(lacks)]
            with m.If(lacks):
                m.d.sync += [adds.eq(1), places.eq(places + 1)]
            with m.Elif(self.negative & ~turned):
                m.d.sync += [adds.eq(1), turns.eq(1), turned.eq(1)]
        with m.Elif(self.take & ~self.decimal):
            m.d.sync += adds.eq(1)
        with m.Elif(self.take):
            m.d.sync += [fraction.eq(fraction | (self.digit != 0)),
                         rest.eq(rest | ((self.digit != 0) & (places >= 2)))]
            with m.If(lacks):
                m.d.sync += [adds.eq(1), places.eq(places + 1)]
            with m.Elif(rounds):
                m.d.sync += [adds.eq(self.digit >= 5), step.eq(1), places.eq(places + 1)]
            with m.If(places == 0):
                m.d.sync += hundredths.eq((self.digit << 3) + (self.digit << 1))
            with m.Elif(places == 1):
                m.d.sync += hundredths.eq(hundredths + self.digit)

        # 10 v + d is 2 v + 8 v + d, v + 1 is 2 v + ~v + 2, and -v is ~(2 v + ~v): so the adder has
        # 2 v as it is, and the other is chosen. A digit is in the bits that these leave free: below
        # 8 v there are three, and below 2 v there is one, beside the carry.
        result = Signal(self.width + 4)
        augend, addend = Signal(self.width + 5), Signal(self.width + 5)
        carry, least = Signal(), Signal(3)
        m.d.comb += [
            carry.eq(Mux(grows, step == 9, ~turns)), least.eq(Mux(step[3], 7, step)),
            augend.eq(Cat(carry, Mux(grows, step[3], ~turns), value)),
            addend.eq(Cat(carry, Mux(grows, Cat(least, value), ~value.as_signed()))),
            result.eq((augend + addend) >> 1),
        ]
        with m.If(adds):
            m.d.sync += [value.eq(result ^ turns.replicate(self.width)),
                         overflow.eq(overflow | (~turns & result[self.width - 1:].any()))]
            with m.If(first):
                m.d.sync += whole.eq(value)
        large = overflow | value[WHOLE:].any() if self.width > WHOLE else overflow
        with m.If(adds & first & large):
            m.d.sync += whole.eq(ALL)
        with m.If(self.clear):
            m.d.sync += [value.eq(0), overflow.eq(0), hundredths.eq(0), rest.eq(0),
                         fraction.eq(0), places.eq(0), turned.eq(0)]

        return m
