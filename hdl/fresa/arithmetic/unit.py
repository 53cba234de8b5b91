"""Arithmetic, one bit a clock."""

from amaranth import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes

__all__ = ["ArithmeticUnit", "Operation"]


class Operation(enum.Enum, shape=unsigned(4)):
    """What :class:`ArithmeticUnit` computes.

    a and b are words, unsigned unless said otherwise; [a] is the pair of words whose high one is a;
    W are the bits of a word. F is a flag that some set and others use. ``ADD`` and ``SUBTRACT`` are
    modulo 2**W.

    ====================== ========================================= ============ =============
    operation              result                                    second word  flag F
    ====================== ========================================= ============ =============
    ADD                    a + b                                                  carry
    ADD_CARRY              a + b + F                                              carry
    SUBTRACT               a - b                                                  borrow: a < b
    SUBTRACT_BORROW        a - b - F                                              borrow
    DIFFERENCE             a - b                                                  a < b, signed
    SELECT                 F ? a : b                                              unchanged
    NEGATE                 F ? -b : b                                             unchanged
    MULTIPLY               a * b, high word                          its low word unchanged
    DIVIDE                 [a] // b; all ones if that has over W                  unchanged
                           bits, or b is 0
    REMAINDER              [a] % b; a < b                                         unchanged
    RATIO                  a * 2**(W - 2) // b; a < 2 b                           unchanged
    ROOT                   square root of [a], rounded down                       unchanged
    NORMALISE              high word of [a] << n: n is the least     n            unchanged
                           that sets its highest bit, W + 1 at most
    SHIFT_LEFT             [a] << b, high word; b up to W + 4        its low word unchanged
    SHIFT_RIGHT            [a] >> b, high word; b up to W + 4        its low word unchanged
    SHIFT_RIGHT_LONG       [a] >> b, high word; b below the power    its low word unchanged
                           of two that is above 2 W
    ====================== ========================================= ============ =============

    Where a condition is not met, the result may be any.
    """

    ADD = 0
    ADD_CARRY = 1
    SUBTRACT = 2
    SUBTRACT_BORROW = 3
    DIFFERENCE = 4
    SELECT = 5
    NEGATE = 6
    RATIO = 7
    MULTIPLY = 8
    DIVIDE = 9
    ROOT = 10
    NORMALISE = 11
    SHIFT_LEFT = 12
    SHIFT_RIGHT = 13
    SHIFT_RIGHT_LONG = 14
    REMAINDER = 15

    @property
    def words(self) -> int:
        """Words of the result."""
        return 2 if self in _PAIRS else 1

    def steps(self, width: int) -> int:
        """Return the clocks of its serial part, for words of `width` bits."""
        match self:
            case Operation.MULTIPLY | Operation.NORMALISE:
                return width // 2 + 1
            case Operation.SHIFT_LEFT | Operation.SHIFT_RIGHT:
                return width // 2 + 3
            case Operation.SHIFT_RIGHT_LONG:
                return width + 1
            case Operation.RATIO:
                return width - 2
            case Operation.DIVIDE | Operation.REMAINDER | Operation.ROOT:
                return width
        return 0


_PAIRS = {Operation.MULTIPLY, Operation.NORMALISE, Operation.SHIFT_LEFT, Operation.SHIFT_RIGHT,
          Operation.SHIFT_RIGHT_LONG}


class ArithmeticUnit(wiring.Component):
    """Adds, multiplies, divides, takes roots and shifts with one adder, in a known time.

    Everything is a step on one pair of registers, which shifts left or right by one or two bits or
    stays, and whose high word takes its sum or difference with a third register, or does not. A
    product shifts right and adds a multiple, -2 to 2, by two bits of the factor and the one below
    (Booth's recoding); quotients and roots shift left, by one bit and by two, and subtract where
    that leaves no borrow. Shifts go by two bits, but in the last step by one.

    Operands come as from a memory, see ``data``. From ``start`` to the first word of the result
    there are ``operation.steps(width) + 3`` clocks, and the second is one later.

    Parameters
    ----------
    width : int
        Bits of a word, W: even, from 4 to 64.

    Members
    -------
    start : In(1)
        Begin. Not from the clock after a start to that before the last word.
    operation : In(Operation)
        What to compute; only with ``start``.
    data : In(width)
        a, in the clock of ``start``; b, one clock later; from then on the low word of [a].
    write : Out(1)
        ``result`` is a word of the result.
    second : Out(1)
        It is the second word.
    result : Out(width)
        A word of the result.
    done : Out(1)
        It is the last word.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``width`` is out of range or odd.
    """

    def __init__(self, *, width: int = 36) -> None:
        self.width = in_range("width", width, 4, 64)
        if width % 2:
            raise ValueError(f"width must be even, not {width!r}")
        super().__init__({
            "start": In(1), "operation": In(Operation), "data": In(width), "write": Out(1),
            "second": Out(1), "result": Out(width), "done": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        width = self.width
        of = Operation

        # What it does, decoded at the start.
        serial, pair, sums, adds_flag, subtracts, ordered, selects, negates = (
            Signal(name=name) for name in ("serial", "pair", "sums", "adds_flag", "subtracts",
                                           "ordered", "selects", "negates"))
        multiplies, divides, overflows, fraction, extracts, normalises, raises, lowers = (
            Signal(name=name) for name in ("multiplies", "divides", "overflows", "fraction",
                                           "extracts", "normalises", "raises", "lowers"))
        before_end = Signal(range(width + 2))  # the step before the last
        decoded = [
            (serial, {each for each in of if each.steps(width)}),
            (pair, {each for each in of if each.words == 2}),
            (sums, {of.ADD, of.ADD_CARRY, of.SUBTRACT, of.SUBTRACT_BORROW, of.DIFFERENCE}),
            (adds_flag, {of.ADD_CARRY, of.SUBTRACT_BORROW}),
            (subtracts, {of.SUBTRACT, of.SUBTRACT_BORROW, of.DIFFERENCE, of.DIVIDE, of.REMAINDER,
                         of.RATIO, of.ROOT}),
            (ordered, {of.DIFFERENCE}), (selects, {of.SELECT}), (negates, {of.NEGATE}),
            (multiplies, {of.MULTIPLY}), (divides, {of.DIVIDE, of.REMAINDER, of.RATIO}),
            (overflows, {of.DIVIDE}), (fraction, {of.RATIO}), (extracts, {of.ROOT}),
            (normalises, {of.NORMALISE}), (raises, {of.SHIFT_LEFT}),
            (lowers, {of.SHIFT_RIGHT, of.SHIFT_RIGHT_LONG}),
        ]

        high = Signal(width + 2)  # a remainder of a root has two more bits than a word
        low = Signal(width)
        third = Signal(width + 2)
        flag = Signal()
        overflow = Signal()
        step = Signal(range(width + 2))  # from 1
        following = Signal(range(width + 2))  # the one after it
        amount = Signal(range(width + 2))

        # What the registers do in a clock is decided in the one before, as far as can be known.
        last, left_one, left_two, right_one, right_two = (
            Signal(name=name) for name in ("last", "left_one", "left_two", "right_one",
                                           "right_two"))
        subtract, carry, twice, takes, takes_if_fits = (
            Signal(name=name) for name in ("subtract", "carry", "twice", "takes", "takes_if_fits"))
        controls = [last, left_one, left_two, right_one, right_two, subtract, carry, twice, takes,
                    takes_if_fits]
        m.d.sync += [control.eq(0) for control in controls]

        # The adder: a - b is a + ~b + 1. A bit below the lowest makes its carry.
        before, multiple, total, kept, after = (
            Signal(width + 3, name=name) for name in ("before", "multiple", "total", "kept",
                                                      "after"))
        augend = Signal(width + 4)
        addend = Signal(width + 4)
        fits = Signal()  # no borrow
        m.d.comb += [
            before.eq(Mux(left_two, Cat(low[-2:], high), Mux(left_one, Cat(low[-1], high), high))),
            before[-1].eq(multiplies & high[-1]),  # sums of a product have a sign
            multiple.eq(Mux(twice, third << 1, third)),
            augend.eq(Cat(carry, before)),
            addend.eq(Cat(carry, Mux(subtract, ~multiple, multiple))),
            total.eq((augend + addend) >> 1),
            fits.eq(total[-1] == 0),
            kept.eq(Mux(takes, total, before)),
            # What may not fit does not shift right: so the carry has the shortest way.
            after.eq(Mux(takes_if_fits & fits, total, Mux(
                right_two, Cat(kept[2:], kept[-1]),
                Mux(right_one, kept >> 1, kept)))),
        ]

        # These are known a clock early, too.
        more = Signal()  # there are two more bits to shift
        ends = Signal()  # the next step is the last
        factor = Signal(3)  # bits for the next step, and the one below
        top = Signal(2)  # highest bits in the next step, where nothing is added

        def prepare_step() -> None:
            m.d.sync += [
                step.eq(following), following.eq(following + 1), last.eq(ends),
                ends.eq(following == before_end), more.eq(following < third[1:1 + len(step)]),
                left_one.eq(divides | ends & (raises & third[0] | normalises & (top[1] == 0))),
                left_two.eq(extracts | ~ends & (raises & more | normalises & (top == 0))),
                right_one.eq(ends & lowers & third[0]),
                right_two.eq(~ends & (multiplies | lowers & more)),
                takes_if_fits.eq(divides | extracts),
                subtract.eq(subtracts), carry.eq(subtracts),
            ]
            with m.If(multiplies):
                m.d.sync += [
                    subtract.eq(factor[2]), carry.eq(factor[2]),
                    twice.eq((factor == 0b011) | (factor == 0b100)),
                    takes.eq((factor != 0b000) & (factor != 0b111)),
                ]

        sign = Signal()
        operand = Signal(width + 2)
        m.d.comb += operand.eq(Cat(self.data, (self.data[-1] & sign).replicate(2)))
        with m.FSM(name="unit_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += sign.eq(self.operation == of.DIFFERENCE)
                with m.If(self.start):
                    m.d.sync += [
                        is_one.eq(Cat(self.operation == each for each in of if each in those).any())
                        for is_one, those in decoded]
                    with m.Switch(self.operation):
                        for each in of:
                            with m.Case(each):
                                m.d.sync += before_end.eq(max(0, each.steps(width) - 1))
                    with m.Switch(self.operation):
                        with m.Case(of.NEGATE, of.MULTIPLY, of.ROOT):
                            m.d.sync += takes.eq(0)
                        with m.Case(of.SELECT):
                            m.d.sync += takes.eq(flag)
                        with m.Default():
                            m.d.sync += takes.eq(1)
                    m.d.sync += [third.eq(operand), high.eq(0), low.eq(self.data)]
                    m.next = "OPERANDS"

            with m.State("OPERANDS"):  # b comes, and a goes where it belongs
                m.d.comb += sign.eq(ordered)
                m.d.sync += [
                    high.eq(after), third.eq(Mux(extracts, 1, operand)), step.eq(0),
                    following.eq(1), ends.eq(0), more.eq(operand[1:1 + len(step)].any()),
                    subtract.eq(subtracts | negates & flag),
                    carry.eq((subtracts | negates & flag) ^ (flag & adds_flag)),
                    takes.eq(Mux(selects, ~flag, sums | negates)), takes_if_fits.eq(fraction),
                ]
                m.next = "FIRST"

            with m.State("FIRST"):  # all of a sum, and the low word comes
                m.d.comb += [factor.eq(Cat(0, low[:2])), top.eq(high[width - 2:width])]
                m.d.sync += [high.eq(after), overflow.eq(fits & overflows), amount.eq(0)]
                with m.If(fraction):
                    m.d.sync += low.eq(fits)
                with m.Elif(~(multiplies | extracts)):
                    m.d.sync += low.eq(self.data)
                with m.If(sums):
                    m.d.sync += flag.eq(total[width])
                m.next = "WRITE"
                with m.If(serial):
                    prepare_step()
                    m.next = "STEPS"

            with m.State("STEPS"):
                m.d.comb += [
                    factor.eq(Cat(low[1], Mux(ends, 0, low[2:4]))),
                    top.eq(Mux(left_two, high[width - 4:], high[width - 2:])),
                ]
                m.d.sync += high.eq(after)
                with m.If(left_one):
                    m.d.sync += low.eq(Cat(divides & (fits | overflow), low))
                with m.If(left_two):
                    m.d.sync += low.eq(low << 2)
                with m.If(right_one):
                    m.d.sync += low.eq(Cat(low[1:], kept[0]))
                with m.If(right_two):
                    m.d.sync += low.eq(Cat(low[2:], kept[:2]))
                with m.If(normalises & left_two):
                    m.d.sync += amount.eq(step << 1)
                with m.If(normalises & left_one):
                    m.d.sync += amount[0].eq(1)
                with m.If(extracts):
                    m.d.sync += third[2:].eq(Cat(fits, third[2:]))
                    with m.If(step == width // 2):  # the high word is used up
                        m.d.sync += low.eq(self.data)
                m.next = "WRITE"
                with m.If(~last):
                    prepare_step()
                    m.next = "STEPS"

            with m.State("WRITE"):
                m.d.comb += [self.write.eq(1), self.done.eq(~pair)]
                m.next = "IDLE"
                with m.If(pair):
                    m.next = "SECOND"

            with m.State("SECOND"):
                m.d.comb += [self.write.eq(1), self.second.eq(1), self.done.eq(1)]
                m.next = "IDLE"

            with m.State("FAULT"):
                pass

        m.d.comb += self.result.eq(high)
        with m.If(extracts):
            m.d.comb += self.result.eq(third[2:])
        with m.Elif(self.second & normalises):
            m.d.comb += self.result.eq(amount)
        with m.Elif(self.second | overflows | fraction):
            m.d.comb += self.result.eq(low)

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
