"""Contract of the arithmetic unit: each operation ends after the clocks that it takes."""

from amaranth import Cat, Mux

from fresa.arithmetic.unit import ArithmeticUnit, Operation

from .contract import Bits, Case, Component, Contract

__all__ = ["ARITHMETIC_UNIT", "clocks"]


def clocks(operation: Operation, width: int) -> int:
    """Return the clocks from a start to the first word of the result."""
    return operation.steps(width) + 3


def describe(c: Contract, dut: ArithmeticUnit) -> None:
    """By the clocks since the start; what takes a single sum is also computed.

    Products, quotients, roots and shifts are compared with Python's, see the tests.
    """
    width, of = dut.width, Operation
    longest = max(clocks(each, width) for each in of)
    state = c.state("unit_state")
    age = c.keep(range(longest + 2), name="age")  # clocks since the start; 0 at rest
    operation = c.keep(Operation, name="operation")
    c.assume((age == 0) | ~dut.start)

    def of_operation(value) -> Bits:
        found: Bits = 0
        for each in of:
            found = Mux(operation == each, int(value(each)), found)
        return found

    first = of_operation(lambda each: clocks(each, width))
    pair = of_operation(lambda each: each.words == 2).any()
    last = first + pair
    c.m.d.sync += age.eq(Mux(c.rst, 0, Mux(
        age == 0, dut.start, Mux(age == last, 0, age + 1))))
    with c.m.If((age == 0) & dut.start):
        c.m.d.sync += operation.eq(dut.operation)

    at_work = age != 0
    c.invariant("first-word-in-time", "The first word of a result comes after the clocks of the "
                "operation, and the second in the next clock.",
                dut.write == (at_work & ((age == first) | (age == last))),
                cover=dut.write & (age == longest))
    c.invariant("second-word-of-a-pair", "Only some have a second word.",
                dut.second == (at_work & pair & (age == last)), cover=dut.second)
    c.invariant("done-with-the-last-word", "The last word is the end of the operation, and nothing "
                "else is.", dut.done == (at_work & (age == last)), cover=dut.done & ~pair)
    c.implication("done-for-a-clock", "That lasts a clock.", when=c.past(dut.done) & c.past(1),
                  then=~dut.done & ~dut.write)
    _sums(c, dut, age, operation)

    c.invariant("clocks-of-states", "Each state has its clocks of the operation.", Cat(
        state("IDLE") == (age == 0), state("OPERANDS") == (age == 1), state("FIRST") == (age == 2),
        state("STEPS") == ((age > 2) & (age < first)), state("WRITE") == (age == first),
        state("SECOND") == ((age > first) & (age == last)), age <= last).all() | state("FAULT")
        | state.is_unused(), cover=state("STEPS"), lemma=True)
    steps = of_operation(lambda each: each.steps(width))
    c.implication("decoded", "What is decoded is of the operation.", when=at_work, then=Cat(
        c.signal("serial") == (steps != 0), c.signal("pair") == pair,
        c.signal("before_end") == Mux(steps == 0, 0, steps - 1)).all(), lemma=True)
    number = c.signal("following")
    c.invariant("counts-steps", "The steps are counted from 1, and the last is known in time.", Cat(
        ~state("FIRST") | (number == 1) & ~c.signal("ends"),
        ~state("STEPS") | (number == age - 1)
        & (c.signal("ends") == (number - 1 == c.signal("before_end")))
        & (c.signal("last") == (age == first - 1))).all(), cover=state("STEPS"), lemma=True)
    c.leaves_unused_codes("unit_state", fault=dut.fault, shows=~(dut.write | dut.done))


def _sums(c: Contract, dut: ArithmeticUnit, age: Bits, operation: Bits) -> None:
    """State what is computed without steps, by the operands as they came."""
    width, of = dut.width, Operation
    a, b, flag = c.keep(width, name="a"), c.keep(width, name="b"), c.keep(1, name="flag")
    with c.m.If(age == 0):
        c.m.d.sync += a.eq(dut.data)
    with c.m.If(age == 1):
        c.m.d.sync += b.eq(dut.data)
    carried = Mux((operation == of.ADD_CARRY) | (operation == of.SUBTRACT_BORROW), flag, 0)
    adds = (operation == of.ADD) | (operation == of.ADD_CARRY)
    total, difference = a + b + carried, a - b - carried
    orders = operation == of.DIFFERENCE
    subtracts = (operation == of.SUBTRACT) | (operation == of.SUBTRACT_BORROW) | orders
    with c.m.If((age == 2) & (adds | subtracts)):
        c.m.d.sync += flag.eq(Mux(adds, total[width], Mux(
            orders, a.as_signed() < b.as_signed(), difference < 0)))
    with c.m.If(c.rst):
        c.m.d.sync += flag.eq(0)
    written = dut.write & ~dut.second
    known = c.keep(1, name="flag_before")  # the flag that the operation has found
    with c.m.If(age == 2):
        c.m.d.sync += known.eq(flag)
    for name, description, which, expected in [
            ("adds", "A sum is that of the operands.", of.ADD, a + b),
            ("adds-carry", "With the carry before.", of.ADD_CARRY, a + b + known),
            ("subtracts", "A difference is that of the operands.", of.SUBTRACT, a - b),
            ("subtracts-borrow", "With the borrow before.", of.SUBTRACT_BORROW, a - b - known),
            ("differs", "So is one with signs.", of.DIFFERENCE, a - b),
            ("selects", "The flag selects an operand.", of.SELECT, Mux(known, a, b)),
            ("negates", "It negates one, or does not.", of.NEGATE, Mux(known, -b, b))]:
        c.implication(name, description, when=written & (operation == which),
                      then=dut.result == expected[:width])
    c.invariant("flag", "The flag is that of the last sum or difference.",
                c.signal("flag") == flag, cover=flag, lemma=True)


ARITHMETIC_UNIT = Component(
    make=ArithmeticUnit, describe=describe, depth=14,
    cases=(Case({"width": 4}), Case({"width": 36}, real=True), Case({"width": 4}, upset=True)))
