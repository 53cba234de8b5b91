"""Square roots, a binary digit a clock."""

from amaranth import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["SquareRoot"]


class SquareRoot(wiring.Component):
    """``root = floor(sqrt(radicand * 4**fraction_bits))``: the root with a binary fraction.

    Digit by digit, as on paper: two bits of the radicand are brought down, and a digit is 1 where
    what remains is as much as 4 times the root so far and 1. That is subtracted in any case; where
    it was too much, the next digit adds (non-restoring). It takes a clock a digit: with ``start``
    in one clock, ``root`` is valid ``integer_bits + fraction_bits + 1`` clocks later, when ``busy``
    is 0 again, and stays until the next start. A start while it is busy begins anew. After a reset
    the root is 0.

    An eighth of the root takes three clocks less, as its last three digits are left out.

    Parameters
    ----------
    integer_bits : int
        Bits of the root before the point: half as many as the radicand has.
    fraction_bits : int
        Bits of the root after the point, from 0.

    Members
    -------
    radicand : In(2 * integer_bits)
        Number, in the clock with ``start``.
    halve : In(1)
        With ``start``: the root is that of half the number, rounded down.
    eighth : In(1)
        With ``start``: an eighth of the root, rounded down.
    start : In(1)
        Begin.
    busy : Out(1)
        Digits are still missing.
    root : Out(integer_bits + fraction_bits)
        Its root, while ``busy`` is 0.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, integer_bits: int, fraction_bits: int = 0) -> None:
        self.integer_bits = in_range("integer_bits", integer_bits, 1, 64)
        self.fraction_bits = in_range("fraction_bits", fraction_bits, 0, 64)
        super().__init__({
            "radicand": In(2 * self.integer_bits), "halve": In(1), "eighth": In(1),
            "start": In(1), "busy": Out(1), "root": Out(self.integer_bits + self.fraction_bits)})

    def elaborate(self, platform) -> Module:
        m = Module()
        digits = len(self.root)
        missing = Signal(range(digits + 1))
        below = Signal(2 * self.integer_bits)  # what is not brought down yet
        halved = Signal()
        kept = Signal()  # bit that a half brings down with the next one
        rest = Signal(signed(digits + 2))  # less twice the root and 1, if below 0
        brought, total = Signal.like(rest), Signal.like(rest)
        m.d.comb += [
            self.busy.eq(missing != 0),
            brought.eq(Cat(Mux(halved, Cat(below[-1], kept), below[-2:]), rest)),
            # Adding 4 times the root and 3 is subtracting the inverse of that, and 1.
            total.eq(brought - Cat(Const(0b01, 2), self.root ^ rest[-1].replicate(digits))),
        ]
        with m.If(self.start):
            m.d.sync += [missing.eq(Mux(self.eighth, max(0, digits - 3), digits)),
                         below.eq(self.radicand), rest.eq(0), self.root.eq(0),
                         halved.eq(self.halve), kept.eq(0)]
            with m.If(self.halve):
                m.d.sync += below[0].eq(0)
        with m.Elif(self.busy):
            m.d.sync += [
                missing.eq(missing - 1),
                below.eq(below << 2),
                kept.eq(below[-2]),
                rest.eq(total),
                self.root.eq(Cat(total[-1] == 0, self.root)),
            ]
        return m
