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
                           that sets its highest bit, W at most
    SHIFT_LEFT             [a] << b, high word; b up to W + 4        its low word unchanged
    SHIFT_RIGHT            [a] >> b, high word; b up to W + 4        its low word unchanged
    SHIFT_RIGHT_LONG       [a] >> b, high word                       its low word unchanged
    ====================== ========================================= ============ =============

    Shifts use the bits of b that count to 2 W, and no others.
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
            case Operation.RATIO:
                return width - 2
            case Operation.SHIFT_LEFT | Operation.SHIFT_RIGHT:
                return width + 4
            case Operation.ROOT | Operation.SHIFT_RIGHT_LONG:
                return 2 * width
        return width if self.value >= Operation.MULTIPLY.value else 0


_PAIRS = {Operation.MULTIPLY, Operation.NORMALISE, Operation.SHIFT_LEFT, Operation.SHIFT_RIGHT,
          Operation.SHIFT_RIGHT_LONG}


class ArithmeticUnit(wiring.Component):
    """Adds, multiplies, divides, takes roots and shifts with one adder, in a known time.

    Everything is a step on one pair of registers, which shifts left or right by a bit or stays, and
    whose high word takes its sum or difference with a third register, or does not. A product
    shifts right and adds where a bit of the factor is 1; quotients and roots shift left and
    subtract where that leaves no borrow, a root in every second step.

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

        operation = Signal(of)
        high = Signal(width + 2)  # of a remainder's two more bits than a word, roots need both
        low = Signal(width)
        third = Signal(width + 2)
        flag = Signal()
        overflow = Signal()
        step = Signal(range(2 * width + 1))  # from 1
        amount = Signal.like(step)

        def one_of(*operations: Operation):
            return Cat(operation == each for each in operations).any()

        division = one_of(of.DIVIDE, of.REMAINDER, of.RATIO)
        serial = operation.as_value()[3] | (operation == of.RATIO)
        pair = Cat(operation == each for each in _PAIRS).any()
        last = Signal.like(step)
        with m.Switch(operation):
            for each in of:
                with m.Case(each):
                    m.d.comb += last.eq(each.steps(width))

        # The adder: a - b is a + ~b + 1. A bit below the lowest makes its carry.
        left, subtract, carry, takes = Signal(), Signal(), Signal(), Signal()
        before, after = Signal(width + 2), Signal(width + 2)
        augend, addend = Signal(width + 4), Signal(width + 4)
        total = Signal(width + 3)
        m.d.comb += [
            before.eq(Mux(left, Cat(low[-1], high), high)),
            augend.eq(Cat(carry, before)),
            addend.eq(Cat(carry, Mux(subtract, ~third, third), subtract)),
            total.eq((augend + addend) >> 1),
            after.eq(Mux(takes, total, before)),
        ]
        fits = Signal()  # no borrow
        m.d.comb += fits.eq(total[-1] == 0)
        digit = Signal()  # of a quotient or a root

        extended = Signal(width + 2)
        m.d.comb += extended.eq(self.data)
        with m.FSM(name="unit_state") as fsm:
            with m.State("IDLE"):
                with m.If(self.start):
                    m.d.comb += extended[width:].eq(
                        ((self.operation == of.DIFFERENCE) & self.data[-1]).replicate(2))
                    m.d.sync += [operation.eq(self.operation), third.eq(extended), high.eq(0),
                                 low.eq(self.data)]
                    m.next = "OPERANDS"

            with m.State("OPERANDS"):  # b comes, and a goes where it belongs
                m.d.comb += [
                    extended[width:].eq(
                        ((operation == of.DIFFERENCE) & self.data[-1]).replicate(2)),
                    takes.eq(Mux(operation == of.SELECT, flag,
                                 ~one_of(of.NEGATE, of.MULTIPLY, of.ROOT))),
                ]
                m.d.sync += [high.eq(after), third.eq(Mux(operation == of.ROOT, 1, extended))]
                m.next = "FIRST"

            with m.State("FIRST"):  # all of a sum, and the low word comes
                m.d.comb += [
                    subtract.eq(Mux(operation == of.NEGATE, flag, division | one_of(
                        of.SUBTRACT, of.SUBTRACT_BORROW, of.DIFFERENCE))),
                    carry.eq(subtract ^ (flag & one_of(of.ADD_CARRY, of.SUBTRACT_BORROW))),
                    takes.eq(Mux(operation == of.SELECT, ~flag,
                                 ~serial | fits & (operation == of.RATIO))),
                ]
                m.d.sync += [high.eq(after), overflow.eq(fits & (operation == of.DIVIDE)),
                             step.eq(1), amount.eq(0)]
                with m.If(operation == of.RATIO):
                    m.d.sync += low.eq(fits)
                with m.Elif(~one_of(of.MULTIPLY, of.ROOT)):
                    m.d.sync += low.eq(self.data)
                with m.If(one_of(of.ADD, of.ADD_CARRY, of.SUBTRACT, of.SUBTRACT_BORROW,
                                 of.DIFFERENCE)):
                    m.d.sync += flag.eq(total[width])
                m.next = "WRITE"
                with m.If(serial):
                    m.next = "STEPS"

            with m.State("STEPS"):
                more, shift_left, shift_right = Signal(), Signal(), Signal()
                m.d.comb += [
                    more.eq(step <= third[:len(step)]),
                    subtract.eq(division | (operation == of.ROOT)), carry.eq(subtract),
                ]
                with m.Switch(operation):
                    with m.Case(of.MULTIPLY):
                        m.d.comb += [takes.eq(low[0]), shift_right.eq(1)]
                    with m.Case(of.DIVIDE, of.REMAINDER, of.RATIO):
                        m.d.comb += [takes.eq(fits), shift_left.eq(1), digit.eq(fits | overflow)]
                    with m.Case(of.ROOT):
                        m.d.comb += [takes.eq(fits & (step[0] == 0)), shift_left.eq(1)]
                        with m.If(step[0] == 0):
                            m.d.sync += third[2:].eq(Cat(fits, third[2:]))
                    with m.Case(of.NORMALISE):
                        m.d.comb += shift_left.eq(high[width - 1] == 0)
                        with m.If(shift_left):
                            m.d.sync += amount.eq(step)
                    with m.Case(of.SHIFT_LEFT):
                        m.d.comb += shift_left.eq(more)
                    with m.Case(of.SHIFT_RIGHT, of.SHIFT_RIGHT_LONG):
                        m.d.comb += shift_right.eq(more)
                m.d.comb += left.eq(shift_left)
                m.d.sync += [high.eq(Mux(shift_right, after >> 1, after)), step.eq(step + 1)]
                with m.If(shift_left):
                    m.d.sync += low.eq(Cat(digit, low))
                with m.If(shift_right):
                    m.d.sync += low.eq(Cat(low[1:], after[0]))
                with m.If((operation == of.ROOT) & (step == width)):  # the high word is used up
                    m.d.sync += low.eq(self.data)
                with m.If(step == last):
                    m.next = "WRITE"

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
        with m.If(operation == of.ROOT):
            m.d.comb += self.result.eq(third[2:])
        with m.Elif(self.second & (operation == of.NORMALISE)):
            m.d.comb += self.result.eq(amount)
        with m.Elif(self.second | one_of(of.DIVIDE, of.RATIO)):
            m.d.comb += self.result.eq(low)

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
