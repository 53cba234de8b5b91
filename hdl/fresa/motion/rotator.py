"""A vector that turns, by shifts and additions."""

from amaranth import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice

__all__ = ["Rotator"]


class Rotator(wiring.Component):
    """Turns a vector by half of a small angle at a time: ``y += x / 2**m``, then ``x -= y / 2**m``.

    The two additions take turns (leapfrog integration): y is that of half an angle after x, and x
    that of half an angle after y, so that the vector never grows nor shrinks, and two half turns
    are an angle of exactly ``2 * asin(2**-(m + 1))``. The first addition after a load is of half
    the size, and brings y to half an angle after x. Shifts are rounded to nearest.

    What is added is also the way that the point at the vector's end goes: a half turn moves it by
    ``vector / 2**m`` along v while ``moves_v``, or by ``-vector / 2**m`` along u while ``moves_u``.

    A half turn takes two clocks. There is one shifter and one adder: the two registers change
    places with each addition, so that the shifter is always at the same one. Reset changes nothing.

    Parameters
    ----------
    width : int
        Bits of x and y, from 4. They must stay from ``-2**(width - 2) * 1.01`` to as much
        above 0, for the sums to fit.
    precision : int
        Bits of the x and y that are loaded, the upper ones, to `width`; zeros follow.

    Members
    -------
    load : In(1)
        Begin with a vector. Only with ``ready``, and without ``turn``.
    x, y : In(signed(precision))
        That vector.
    shift : In(5)
        m, to 30.
    mirror : In(1)
        Negate y, which makes a clockwise arc one that is counter-clockwise (by inverting its bits,
        which is less by one unit).
    turn : In(1)
        Make half a turn. Ignored unless ``ready``.
    ready : Out(1)
        A half turn begins in this clock if ``turn`` is 1.
    vector : Out(signed(width))
        x while ``moves_v``, y while ``moves_u``.
    moves_u, moves_v : Out(1)
        The half turn that begins in this clock moves the point along u or v.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int = 43, precision: int = 36) -> None:
        self.width = in_range("width", width, 4, 64)
        self.precision = in_range("precision", precision, 2, self.width)
        super().__init__({
            "load": In(1), "x": In(signed(self.precision)), "y": In(signed(self.precision)),
            "shift": In(5), "mirror": In(1), "turn": In(1), "ready": Out(1),
            "vector": Out(signed(self.width)), "moves_u": Out(1), "moves_v": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        zeros = self.width - self.precision

        source = Signal(signed(self.width), reset_less=True)
        target = Signal(signed(self.width), reset_less=True)
        source_is_x = Signal(reset_less=True)
        amount = Signal(5, reset_less=True)
        first = Signal(reset_less=True)
        adding = Signal(reset_less=True)
        # By the amount without its lowest bit, and inverted for a difference. Bit 0 is that of a
        # half, or bit 1 is where the adder shifts by that bit, too.
        shifted = Signal(signed(self.width + 1), reset_less=True)
        minus = Signal()

        m.d.comb += [
            self.ready.eq(~adding),
            self.vector.eq(source),
            self.moves_v.eq(self.turn & self.ready & source_is_x),
            self.moves_u.eq(self.turn & self.ready & ~source_is_x),
        ]
        m.d.sync += [
            shifted.eq((Cat(Const(0, 1), source).as_signed() >> Cat(Const(0, 1), amount[1:]))
                       ^ minus.replicate(self.width + 1)),
            adding.eq(self.turn & self.ready),
        ]
        # a + (s + half), or a - (s + half) as a + ~s + ~half
        term = Signal(signed(self.width))
        half = Signal()
        total = Signal(self.width)
        m.d.comb += [
            minus.eq(~source_is_x),
            term.eq(Mux(amount[0], shifted >> 2, shifted >> 1)),
            half.eq(Mux(amount[0], shifted[1], shifted[0])),
            total.eq(add_choice(target, term, half)),
        ]
        with m.If(adding):
            m.d.sync += [
                source.eq(total),
                target.eq(source),
                source_is_x.eq(~source_is_x),
                amount.eq(amount - first),
                first.eq(0),
            ]
        with m.If(self.load):
            m.d.sync += [
                source.eq(self.x << zeros),
                target.eq(Mux(self.mirror, ~(self.y << zeros), self.y << zeros)),
                source_is_x.eq(1),
                amount.eq(self.shift + 1),
                first.eq(1),
            ]

        return m
