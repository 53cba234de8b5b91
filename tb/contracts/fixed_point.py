"""Contract of the accumulator of fixed-point numbers."""

from amaranth import Mux

from fresa.protocol import FixedPoint

from .contract import Case, Component, Contract

__all__ = ["FIXED_POINT"]

WHOLE = (1 << 24) - 1
"""Largest whole part that is shown beside the value."""


def describe(c: Contract, dut: FixedPoint) -> None:
    """The number is that of the digits since `clear`, beside sums of the contract's own."""
    width, limit = dut.width, (1 << dut.width - 1) - 1
    complete = c.keep(1, name="is_complete")
    was_decimal, was_finish = c.past(dut.decimal & ~dut.clear & ~c.rst), c.past(
        dut.finish & ~dut.done & ~c.rst)
    c.assume(~(dut.take & (dut.finish | dut.clear)) & ~(dut.finish & dut.clear))
    c.assume(~dut.take | (dut.digit <= 9))
    c.assume(~complete | ~(dut.take | dut.finish))
    c.assume(~was_decimal | dut.decimal)
    c.assume(~was_finish | (dut.finish & (dut.negative == c.past(dut.negative))))

    # What is added is added a clock later, as in the component: so induction sees equal terms.
    places = c.keep(range(dut.decimals + 2), name="places")
    c.assume(complete | ~((places != 0) | was_finish) | (dut.short == c.past(dut.short)))
    hundredths = c.keep(7, name="two_decimals")
    rest, fraction = c.keep(1, name="not_exact"), c.keep(1, name="not_integer")
    minus = c.keep(1, name="is_minus")
    grows, rounds = c.keep(1, name="grows"), c.keep(1, name="rounds")
    digit, first = c.keep(4, name="digit"), c.keep(1, name="first_decimal")
    most = Mux(dut.short, dut.decimals // 2, dut.decimals)
    lacks = places < most
    decimal = dut.take & dut.decimal
    c.m.d.sync += [
        grows.eq(~c.rst & ((dut.take & (~dut.decimal | lacks)) | (dut.finish & lacks))),
        rounds.eq(~c.rst & decimal & (places == most) & (dut.digit >= 5)),
        digit.eq(Mux(dut.take, dut.digit, 0)),
        first.eq(~c.rst & (places == 0) & (decimal | dut.finish)),
    ]
    sum_, large = c.keep(width, name="sum"), c.keep(1, name="too_large")
    whole, many = c.keep(24, name="whole_part"), c.keep(1, name="whole_too_large")
    more = Mux(grows, (sum_ << 3) + (sum_ << 1) + digit, sum_ + rounds)
    with c.m.If(c.rst | dut.clear):
        c.m.d.sync += [register.eq(0) for register in (
            sum_, large, places, hundredths, rest, fraction, complete, minus)]
    with c.m.Else():
        c.m.d.sync += [sum_.eq(more), large.eq(large | (more > limit)),
                       complete.eq(complete | dut.done)]
        with c.m.If(dut.finish):
            c.m.d.sync += minus.eq(dut.negative)
        with c.m.If((decimal & (places <= most)) | (dut.finish & lacks)):
            c.m.d.sync += places.eq(places + 1)
        with c.m.If(decimal):
            c.m.d.sync += [
                hundredths.eq(Mux(places == 0, dut.digit * 10,
                                  hundredths + Mux(places == 1, dut.digit, 0))),
                rest.eq(rest | ((places > 1) & (dut.digit != 0))),
                fraction.eq(fraction | (dut.digit != 0))]
    with c.m.If(first):
        c.m.d.sync += [whole.eq(sum_), many.eq(large | (sum_ > WHOLE))]

    number = dut.number
    c.implication("value", "A number that fits has its value.", when=complete & ~large,
                  then=~number.overflow & (number.value == Mux(minus, -sum_, sum_)))
    c.implication("overflow", "One that does not is marked.", when=complete & large,
                  then=number.overflow)
    c.implication("whole", "The whole part is shown.", when=complete & ~many,
                  then=number.whole == whole)
    c.implication("whole-saturates", "A larger one shows as the largest.", when=complete & many,
                  then=number.whole == WHOLE)
    c.implication("hundredths", "Two decimals are shown.", when=complete,
                  then=number.hundredths == hundredths)
    c.implication("exact", "Anything but zeros behind these shows.", when=complete,
                  then=number.exact == ~rest)
    c.implication("integer", "Anything but zeros behind the point shows.", when=complete,
                  then=number.integer == ~fraction)
    c.implication("done-in-time", "It is done in a clock for each decimal that is lacking, one for "
                  "a minus sign, and one.", when=dut.finish & ~lacks & (~dut.negative | (
                      c.past(dut.finish & ~lacks & ~c.rst))), then=dut.done)
    c.implication("done-at-end-only", "And not before.", when=dut.done,
                  then=dut.finish & ~lacks)
    c.implication("clear", "After `clear`, and after reset, a number begins at nothing.",
                  when=c.past(c.rst | dut.clear),
                  then=(number.value == 0) & ~number.overflow & number.exact & number.integer
                  & (number.hundredths == 0))

    adds, turns, turned = c.signal("adds"), c.signal("turns"), c.signal("turned")
    counts = adds & ~turns
    c.invariant("sum-held", "The sum is held, and its sign changes once, at the end.",
                (c.signal("overflow") == large)
                & (large | (c.signal("value") == Mux(turned & ~turns, -sum_, sum_)[:width])),
                cover=sum_ == 21)
    c.invariant("next-operation", "What is to be added is kept for a clock.",
                (counts == (grows | rounds)) & (~counts | (c.signal("grows") == grows))
                & (~counts | (c.signal("step") == Mux(rounds, 1, digit)))
                & (~rounds | ~grows) & (~turns | (adds & turned & ~c.signal("grows")
                                                  & (c.signal("step") == 1)))
                & (~turned | (minus & (complete | ~lacks) & ~counts)), cover=turns)
    c.invariant("whole-held", "The whole part is kept with the first decimal.",
                (places == 0) | first | (number.whole == Mux(many, WHOLE, whole)), cover=first)
    c.invariant("registers", "Decimals are counted, and what is behind the second is noted.",
                (c.signal("places") == places) & (c.signal("hundredths") == hundredths)
                & (c.signal("rest") == rest) & (c.signal("fraction") == fraction)
                & (~first | ((places == 1) & counts & c.signal("first")))
                & (~(counts & c.signal("first")) | first)
                & (~turned | complete | was_finish)
                & (~complete | (~adds & (turned == minus))), cover=turned)


FIXED_POINT = Component(
    make=FixedPoint, describe=describe, depth=12,
    cases=(Case({"width": 8, "decimals": 2}), Case({"width": 9, "decimals": 3}),
           Case({"width": 44, "decimals": 6}, real=True)))
