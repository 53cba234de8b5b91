"""Arithmetic, one bit a clock."""

from amaranth import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice, choice_code, choose
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


_LEFT_ONE, _LEFT_TWO, _STAY, _RIGHT = (choice_code(number) for number in range(4))
"""Moves of the registers, as codes of :func:`choose`."""


class ArithmeticUnit(wiring.Component):
    """Adds, multiplies, divides, takes roots and shifts with one adder, in a known time.

    Everything is a step on one pair of registers, which shifts left or right by one or two bits or
    stays, and whose high word takes its sum or difference with a third register, or does not. A
    product shifts right and adds a multiple, -2 to 2, by two bits of the factor and the one below
    (Booth's recoding); quotients and roots shift left, by one bit and by two, and subtract where
    that leaves no borrow. Shifts go by two bits, but in the last step by one, which is to the left:
    to the right an odd amount goes one too far first.

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
        multiplies, divides, overflows, fraction, extracts, normalises, raises, lowers, lower = (
            Signal(name=name) for name in ("multiplies", "divides", "overflows", "fraction",
                                           "extracts", "normalises", "raises", "lowers", "lower"))
        before_end = Signal(range(width + 2))  # the step before the last
        decoded = [
            (serial, {each for each in of if each.steps(width)}),
            (pair, {each for each in of if each.words == 2}),
            (sums, {of.ADD, of.ADD_CARRY, of.SUBTRACT, of.SUBTRACT_BORROW, of.DIFFERENCE}),
            (adds_flag, {of.ADD_CARRY, of.SUBTRACT_BORROW}),
            (subtracts, {of.SUBTRACT, of.SUBTRACT_BORROW, of.DIFFERENCE, of.DIVIDE, of.REMAINDER,
                         of.RATIO}),
            (ordered, {of.DIFFERENCE}), (selects, {of.SELECT}), (negates, {of.NEGATE}),
            (multiplies, {of.MULTIPLY}), (divides, {of.DIVIDE, of.REMAINDER, of.RATIO}),
            (overflows, {of.DIVIDE}), (fraction, {of.RATIO}), (extracts, {of.ROOT}),
            (normalises, {of.NORMALISE}), (raises, {of.SHIFT_LEFT}),
            (lowers, {of.SHIFT_RIGHT, of.SHIFT_RIGHT_LONG}),
            (lower, {of.DIVIDE, of.RATIO, of.ROOT}),
        ]

        high = Signal(width + 3)  # a sum of a product has three more bits than a word
        low = Signal(width)
        below = Signal()  # the bit that a shift to the right has lost last
        third = Signal(width + 2)
        flag = Signal()
        overflow = Signal()
        following = Signal(range(width + 2))  # number of the next step, from 1
        amount = Signal(range(width + 2))

        # What the registers do in a clock is decided in the one before, as far as can be known.
        last, holds, subtract, carry, twice, takes, if_fits = (
            Signal(name=name) for name in ("last", "holds", "subtract", "carry", "twice", "takes",
                                           "if_fits"))
        move, low_move = Signal(3, init=_STAY), Signal(3, init=_STAY)
        m.d.sync += [control.eq(control.init) for control in (
            last, holds, subtract, carry, twice, takes, if_fits, move, low_move)]

        # The adder: a - b is a + ~b + 1.
        before = Signal(width + 3)
        total = Signal(width + 3)
        multiple = Signal(width + 3)
        fits = Signal()  # no borrow
        after = Signal(width + 3)
        m.d.comb += [
            before.eq(choose([Cat(low[-1], high), Cat(low[-2:], high), high,
                              Cat(high[2:], high[-1].replicate(2))], move, width + 3)),
            multiple.eq(Mux(takes, Mux(twice, third << 1, third), 0)
                        ^ subtract.replicate(width + 3)),
            total.eq(add_choice(before, multiple, carry)), fits.eq(total[-1] == 0),
            after.eq(Mux(if_fits & ~fits, before, total)),
        ]

        # These are known a clock early, too.
        more = Signal()  # there are two more bits to shift
        ends = Signal()  # the next step is the last
        factor = Signal(3)  # bits for the next step, and the one below
        top = Signal(2)  # highest bits in the next step, where nothing is added
        done = Signal(len(following) + 1)  # bits that are shifted before the step after that
        m.d.comb += [factor.eq(Cat(below, low[:2])), top.eq(before[width - 2:width]),
                     done.eq(Cat(raises, following))]

        def prepare_step() -> None:
            one = divides | (ends & ((third[0] & (raises | (lowers & ~more)))
                                     | (normalises & (top[1] == 0))))
            two = extracts | (~ends & ((raises & more) | (normalises & (top == 0))))
            right = multiplies | (~ends & lowers & more)
            half = extracts & (following == width // 2)  # the high word is used up
            chosen = Mux(one, _LEFT_ONE, Mux(two, _LEFT_TWO, Mux(right, _RIGHT, _STAY)))
            m.d.sync += [
                following.eq(following + 1), last.eq(ends), ends.eq(following == before_end),
                # Right by an odd amount is one too far at first, then back by one.
                more.eq(done < third[:len(done)]),
                move.eq(chosen), low_move.eq(Mux(half, _STAY, chosen)),
                holds.eq(chosen == _STAY),
                if_fits.eq(divides | extracts), takes.eq(divides | extracts),
                subtract.eq(divides | extracts), carry.eq(divides | extracts),
            ]
            with m.If(multiplies):
                m.d.sync += [
                    subtract.eq(factor[2] & ~factor.all()), carry.eq(factor[2] & ~factor.all()),
                    twice.eq((factor == 0b011) | (factor == 0b100)),
                    takes.eq(factor.any() & ~factor.all()),
                ]
            with m.If(normalises & two):
                m.d.sync += amount[1:].eq(following)
            with m.If(normalises & one):
                m.d.sync += amount[0].eq(1)

        sign = Signal()
        operand = Signal(width + 2)
        m.d.comb += operand.eq(Cat(self.data, (self.data[-1] & sign).replicate(2)))
        with m.If(~holds):
            m.d.sync += low.eq(choose([Cat(below | overflow | (divides & fits), low), low << 2,
                                       self.data, Cat(low[2:], high[:2])], low_move, width))
        clears = Signal()
        with m.If(clears):
            m.d.sync += low.eq(0)
        with m.If(low_move == _RIGHT):
            m.d.sync += below.eq(low[1])
        m.d.sync += high.eq(after)
        ended = Signal()
        with m.FSM(name="unit_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += sign.eq(self.operation == of.DIFFERENCE)
                m.d.sync += [third.eq(operand), high.eq(0)]
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
                    m.d.sync += holds.eq(1)
                    m.next = "OPERANDS"

            with m.State("OPERANDS"):  # b comes, and a goes where it belongs
                m.d.comb += sign.eq(ordered)
                m.d.sync += [
                    third.eq(Mux(extracts, 1, operand)), below.eq(0), overflow.eq(0),
                    amount.eq(0), following.eq(1), ends.eq(0),
                    more.eq(raises < operand[:len(done)]),
                    subtract.eq(subtracts | negates & flag),
                    carry.eq((subtracts | negates & flag) ^ (flag & adds_flag)),
                    takes.eq(Mux(selects, ~flag, sums | negates | divides)), if_fits.eq(divides),
                    move.eq(Mux(multiplies, _RIGHT, _STAY)),
                    low_move.eq(Mux(multiplies, _RIGHT, Mux(fraction, _LEFT_ONE, _STAY))),
                    holds.eq(extracts),
                ]
                m.d.comb += clears.eq(fraction)
                m.next = "FIRST"

            with m.State("FIRST"):  # all of a sum, and the low word comes
                m.d.sync += overflow.eq(fits & overflows)
                with m.If(sums):
                    m.d.sync += flag.eq(total[width])
                m.next = "WRITE"
                with m.If(serial):
                    prepare_step()
                    m.next = "STEPS"
                with m.Else():
                    m.d.comb += ended.eq(1)

            with m.State("STEPS"):
                with m.If(extracts):
                    m.d.sync += third[2:].eq(Cat(fits, third[2:]))
                m.next = "WRITE"
                with m.If(~last):
                    prepare_step()
                    m.next = "STEPS"
                with m.Else():
                    m.d.comb += ended.eq(1)
                    m.d.sync += holds.eq(1)

            with m.State("WRITE"):
                m.d.comb += [self.write.eq(1), self.done.eq(~pair)]
                m.d.sync += lower.eq(1)
                m.d.comb += clears.eq(normalises)
                m.next = "IDLE"
                with m.If(pair):
                    m.next = "SECOND"

            with m.State("SECOND"):
                m.d.comb += [self.write.eq(1), self.second.eq(1), self.done.eq(1)]
                m.next = "IDLE"

            with m.State("FAULT"):
                pass

        # A root is in the third register, and nothing else then.
        with m.If(ended & ~extracts):
            m.d.sync += third.eq(0)
        m.d.comb += self.result.eq(Mux(lower, low, high) | third[2:]
                                   | Mux(self.second & normalises, amount, 0))

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
