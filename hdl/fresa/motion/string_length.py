"""Length of a string from a pulley to a point that moves, without a square root."""

from math import isqrt

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice

__all__ = ["TICKS_LOG2", "StringLength", "nearest_steps"]

TICKS_LOG2 = 3
"""A step of a string is 2 to this power of ticks, in which places are counted."""


def nearest_steps(across: int, below: int) -> int:
    """Return the length of a string to the nearest step; its end is in ticks, from the pulley."""
    square = 4 * (across**2 + below**2)
    double = isqrt(square >> 2 * TICKS_LOG2)  # odd where the rest of the length is half or more
    return (double + ((double << TICKS_LOG2) ** 2 < square)) // 2


class StringLength(wiring.Component):
    """Gives a step where the length of a string, in whole steps, is to be another.

    A point hangs `across` and `below` ticks from the pulley over which its string runs. Its length
    D is kept as the whole number of steps, of K ticks each, that is nearest to the true one, by a
    number that a root would be taken of: ``E = across² + below² - (K D)²``. A tick changes it by an
    odd number, ``(n + 1)² - n² = 2n + 1``, and a step by ``K² (2D + 1)``. While the length is right
    E is from ``-K² D + K²/4``, not included, to ``K² D + K²/4``: where it is not, D takes a step.
    Nothing is rounded, so the length is within half a step for ever.

    An adder makes one of these sums in a clock: steps first, then ticks of `across`. A tick is
    taken in, or waits for one of the other direction, and its step comes 2 clocks later, or up to 4
    if there are ticks in both directions.

    Parameters
    ----------
    bits : int
        Bits of `across` and `below`.
    first_across, first_below : int
        Where the point is at first, in ticks; at the pulley unless given.

    Members
    -------
    begin : In(1)
        Be where it is at first; ticks that wait are forgotten.
    tick : In(2)
        Move by a tick, across and below. Not while an earlier tick of the same direction waits, and
        never to less than 0 or beyond `bits`.
    away : In(2)
        With these: away from the pulley.
    step, longer : Out(1)
        The length changes by a step in this clock; it becomes longer.
    across, below : Out(bits)
        Where the point is, in ticks.
    length : Out(bits - TICKS_LOG2 + 1)
        Length in steps.
    busy : Out(1)
        A tick waits, or a step is to come: the length may be off by more than half a step.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: thesis of the hanging plotter, whose machine takes the root of the length at both ends
    of a line, and bows what is between.
    """

    def __init__(self, *, bits: int = 19, first_across: int = 0, first_below: int = 0) -> None:
        self.bits = in_range("bits", bits, TICKS_LOG2 + 1, 32)
        most = (1 << bits) - 1
        self.first = (in_range("first_across", first_across, 0, most),
                      in_range("first_below", first_below, 0, most))
        self.first_length = nearest_steps(*self.first)
        super().__init__({
            "begin": In(1), "tick": In(2), "away": In(2), "step": Out(1), "longer": Out(1),
            "across": Out(self.bits, init=first_across), "below": Out(self.bits, init=first_below),
            "length": Out(self.bits - TICKS_LOG2 + 1, init=self.first_length), "busy": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        # E - K²/4 - 1: above the bits of K² it says by how many K² the length is beyond.
        error = sum(place**2 for place in self.first) - (self.first_length << TICKS_LOG2) ** 2
        excess = Signal(signed(self.bits + TICKS_LOG2 + 2),
                        init=error - (1 << 2 * TICKS_LOG2 - 2) - 1)
        short = Signal()  # the string is too long, if it is not right
        beyond = Signal(len(excess) - 2 * TICKS_LOG2 - 1)
        m.d.comb += [
            short.eq(excess[-1]),
            beyond.eq((excess >> 2 * TICKS_LOG2) ^ short.replicate(len(beyond))),
            self.step.eq((beyond >= self.length) & ~(short & (self.length == 0))),
            self.longer.eq(~short),
        ]

        # A tick, or a step, changes a number by one, and E by the odd number between its squares.
        waits = Signal(2)
        ways = Signal(2)
        backward = Signal()  # the number becomes less
        lower = Signal(self.bits)  # the lesser of what it is and becomes
        odd = Signal(signed(self.bits + 2))
        m.d.comb += [
            self.busy.eq(waits.any() | self.step),
            backward.eq(Mux(self.step, short, ~Mux(waits[0], ways[0], ways[1]))),
            lower.eq(Mux(self.step, self.length, Mux(waits[0], self.across, self.below))
                     - backward),
            odd.eq((lower ^ (backward ^ self.step).replicate(self.bits + 1)) << 1 | 1),
        ]
        with m.If(self.busy):
            m.d.sync += excess.eq(add_choice(
                excess, Mux(self.step, odd << 2 * TICKS_LOG2, odd)))
        changed = lower + ~backward
        m.d.sync += [waits.eq(waits | self.tick), ways.eq(Mux(self.tick[0], self.away[0], ways[0])
                     | Mux(self.tick[1], self.away[1], ways[1]) << 1)]
        with m.If(self.step):
            m.d.sync += self.length.eq(changed)
        with m.Elif(waits[0]):
            m.d.sync += [self.across.eq(changed), waits[0].eq(self.tick[0])]
        with m.Elif(waits[1]):
            m.d.sync += [self.below.eq(changed), waits[1].eq(self.tick[1])]
        with m.If(self.begin):
            m.d.sync += [each.eq(each.init) for each in (
                excess, waits, self.length, self.across, self.below)]
        return m
