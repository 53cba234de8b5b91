"""The speed that a block may have, by its feed, its limit and the override: squared."""

from amaranth import Cat, Const, Module, Mux, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from ..arithmetic.line import WIDTH
from ..checks import in_range
from ..choice import add_choice
from .blocks import OverrideKind
from .overrides import OVERRIDE_BITS, override_of

__all__ = ["NominalSpeed"]


class NominalSpeed(wiring.Component):
    """Squares the smaller of feed x override and limit, of the block that runs and of the next.

    One adder does it again and again, digit by digit, for one block and then for the other. So both
    obey an override ``3 * (speed_bits + 14)`` clocks after it changes, at most, if no block is
    loaded or taken meanwhile, with which it begins again. The next block is ready
    ``speed_bits + 15`` clocks after it was loaded.

    Parameters
    ----------
    speed_bits : int
        Bits of a speed, from 8 to 64.
    word_bits : int
        Bits of a word, at least as many.

    Members
    -------
    word : In(word_bits)
        Of the next block, with ``load``.
    load : In(2)
        Bit 0: it is the speed that is never exceeded. Bit 1, after that: it is a hundredth of the
        feed, in 2**-8 of a speed. Each for one clock, not with ``take``.
    override : In(OverrideKind)
        Which override multiplies the feed of the next block, from ``load[1]`` to ``take``.
    take : In(1)
        The next block runs from the next clock on.
    feed, rapid : In(8)
        Overrides in percent, from 10 to 200, and up to 100.
    ready : Out(1)
        The square of the next block is known.
    nominal : Out(2 * speed_bits)
        Square of the speed of the block that runs.

    Raises
    ------
    ValueError
        If ``speed_bits`` is out of range.
    """

    def __init__(self, *, speed_bits: int = 31, word_bits: int = WIDTH) -> None:
        self.speed_bits = in_range("speed_bits", speed_bits, OVERRIDE_BITS, 64)
        self.word_bits = in_range("word_bits", word_bits, speed_bits, 64)
        super().__init__({
            "word": In(word_bits), "load": In(2), "override": In(OverrideKind), "take": In(1),
            "feed": In(OVERRIDE_BITS), "rapid": In(OVERRIDE_BITS),
            "ready": Out(1), "nominal": Out(2 * speed_bits)})

    def elaborate(self, platform) -> Module:
        m = Module()
        bits = self.speed_bits
        loads = 2  # steps: what was read is there; then come digits of the override
        compares = loads + OVERRIDE_BITS + 1  # the product is there
        limits = compares + 1  # then come digits of the speed
        stores = limits + bits + 1
        step = Signal(range(stores + 1))
        of_running = Signal()  # what is computed
        following = Signal.like(self.nominal)
        running = Signal(OverrideKind)

        # Of both blocks, by which of two places is that of the next. A choice between registers
        # would be as large as all else.
        place = Signal()
        m.submodules.bounds = bounds = memory.Memory(shape=self.word_bits, depth=4, init=[],
                                                     attrs={"ram_style": "block"})
        write, read = bounds.write_port(), bounds.read_port()
        m.d.comb += [
            write.addr.eq(Cat(self.load[1], place)), write.en.eq(self.load.any()),
            write.data.eq(self.word),
            read.addr.eq(Cat(step == 0, place ^ of_running)),
        ]
        kind = Mux(of_running, running, self.override)
        percent = override_of(kind, feed=self.feed, rapid=self.rapid)

        # A sum moves right into the digits of the factor, which it has used.
        factor = Signal(self.word_bits)
        high = Signal(self.word_bits)
        low = Signal(bits)
        total = Signal(self.word_bits + 1)
        bound = Signal(self.word_bits)  # a register behind the memory
        slower = Signal()
        speed = Signal(bits)
        digits = Signal(self.word_bits)
        m.d.comb += [
            total.eq(add_choice(Cat(high, Const(0, 1)), Cat(Mux(low[0], factor, 0), Const(0, 1)))),
            speed.eq(Mux(slower, high, bound)),
            # That which the factor becomes, so that synthesis has one choice for both.
            digits.eq(Mux(step == limits, speed, bound)),
        ]
        m.d.sync += [step.eq(step + 1), bound.eq(read.data), slower.eq(high < bound)]
        with m.If(step != compares):
            m.d.sync += Cat(low, high).eq(Cat(low[1:], total))
        with m.If(step == loads):
            m.d.sync += [factor.eq(bound), low.eq(percent), high.eq(0)]
        with m.If(step == limits):
            m.d.sync += [factor.eq(speed), low.eq(digits), high.eq(0)]
        with m.If(step >= stores):
            m.d.sync += [step.eq(0), of_running.eq(~of_running)]
            with m.If(of_running):
                m.d.sync += self.nominal.eq(Cat(low, high))
            with m.Else():
                m.d.sync += [following.eq(Cat(low, high)), self.ready.eq(1)]
        with m.If(self.load[1]):
            m.d.sync += [step.eq(0), of_running.eq(0), self.ready.eq(0)]
        with m.If(self.take):
            m.d.sync += [step.eq(0), place.eq(~place), running.eq(self.override),
                         self.nominal.eq(following)]
        return m
