"""Contract of the arithmetic unit: what each operation gives.

It is for bounded proofs, of every operand after power-up: an induction would have to know what is
in the registers after each step.
"""

from amaranth import Cat, Mux

from fresa.arithmetic import ArithmeticUnit, Operation

from .contract import Bits, Case, Component, Contract

__all__ = ["ARITHMETIC"]

OF = Operation


def describe(c: Contract, dut: ArithmeticUnit) -> None:
    """Each operation gives its result, and sets the flag.

    The registers of the contract are the operands of the present operation, and the flag before it.
    """
    width = dut.width
    state = c.state("unit_state")
    idle, operands, first, steps = (state(each) for each in (
        "IDLE", "OPERANDS", "FIRST", "STEPS"))
    begins = idle & dut.start & ~c.rst
    c.assume(~dut.start | idle)
    operation = c.keep(Operation, name="operation")
    a, b, low = (c.keep(width, name=name) for name in ("a", "b", "low_of_a"))
    flag = c.signal("flag")
    before = c.keep(1, name="flag_before")
    with c.m.If(begins):
        c.m.d.sync += [operation.eq(dut.operation), a.eq(dut.data), before.eq(flag)]
    with c.m.If(operands):
        c.m.d.sync += b.eq(dut.data)
    with c.m.If(first):
        c.m.d.sync += low.eq(dut.data)
    c.assume(~steps | (dut.data == low))  # it stays
    written = c.keep(width, name="written")
    with c.m.If(dut.write):
        c.m.d.sync += written.eq(dut.result)
    done, second = dut.done, dut.second
    pair = Cat(low, a)
    both = Cat(dut.result, written)  # in the clock of the second word

    def one_of(*operations: Operation) -> Bits:
        return Cat(operation == each for each in operations).any()

    late = c.keep(range(2 * width), name="late")  # clocks since the start
    with c.m.If(begins):
        c.m.d.sync += late.eq(1)
    with c.m.Else():
        c.m.d.sync += late.eq(late + 1)
    for each in OF:
        c.implication(f"{each.name.lower()}-ends", "It takes its clocks.",
                      when=done & one_of(each), then=late == each.steps(width) + 2 + each.words)
    carried = one_of(OF.ADD_CARRY, OF.SUBTRACT_BORROW) & before
    for name, those, total in [
            ("sum", one_of(OF.ADD, OF.ADD_CARRY), a + b + carried),
            ("difference", one_of(OF.SUBTRACT, OF.SUBTRACT_BORROW), a - b - carried),
            ("ordered-difference", one_of(OF.DIFFERENCE), a.as_signed() - b.as_signed())]:
        c.implication(name, "A sum or difference is right, and the flag is its carry, borrow or "
                      "sign.", when=done & those,
                      then=Cat(dut.result, flag) == total[:width + 1])
    c.implication("flag-kept", "Other operations leave the flag as it is.",
                  when=done & ~one_of(OF.ADD, OF.ADD_CARRY, OF.SUBTRACT, OF.SUBTRACT_BORROW,
                                      OF.DIFFERENCE), then=flag == before)
    c.implication("selected", "The flag selects a.", when=done & one_of(OF.SELECT),
                  then=dut.result == Mux(before, a, b))
    c.implication("negated", "The flag negates b.", when=done & one_of(OF.NEGATE),
                  then=dut.result == Mux(before, -b, b)[:width])
    c.implication("product", "A product is that of both words.",
                  when=done & one_of(OF.MULTIPLY), then=second & (both == a * b))
    c.implication("quotient", "A quotient is rounded down, or all ones if it has too many bits.",
                  when=done & one_of(OF.DIVIDE),
                  then=Mux(a < b, (dut.result * b <= pair) & (pair - dut.result * b < b),
                           dut.result.all()))
    c.implication("remainder", "A remainder is below the divisor, and what the quotient leaves.",
                  when=done & one_of(OF.REMAINDER) & (a < b),
                  then=(dut.result < b) & (dut.result == pair % b))
    c.implication("ratio", "A ratio is rounded down.",
                  when=done & one_of(OF.RATIO) & (a < (b << 1)),
                  then=(dut.result * b <= a << width - 2)
                  & ((a << width - 2) - dut.result * b < b))
    c.implication("root", "A root is rounded down.", when=done & one_of(OF.ROOT),
                  then=(dut.result * dut.result <= pair)
                  & (pair < (dut.result + 1) * (dut.result + 1)))
    count = dut.result
    amount = count[:(width + 1).bit_length()]
    shifted = pair << amount
    c.implication("normalised", "A normalised word has its highest bit set, and no bit is lost; or "
                  "it was shifted by W + 1.",
                  when=done & one_of(OF.NORMALISE),
                  then=second & (shifted >> width == written) & (count <= width + 1)
                  & (written[-1] | (count == width + 1)))
    short = b <= width + 4
    c.implication("shift-left", "A shift to the left is by b.",
                  when=done & one_of(OF.SHIFT_LEFT) & short,
                  then=second & (both == (pair << b[:(width + 4).bit_length()])[:2 * width]))
    c.implication("shift-right", "A shift to the right is by b.",
                  when=done & (one_of(OF.SHIFT_RIGHT) & short
                               | one_of(OF.SHIFT_RIGHT_LONG) & (b < 2 << width.bit_length())),
                  then=second & (both == pair >> b))


ARITHMETIC = Component(make=ArithmeticUnit, describe=describe, depth=16,
                       cases=(Case({"width": 8}),))
