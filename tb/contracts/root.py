"""Contract of the square root."""

from amaranth import Cat, Mux

from fresa.motion import SquareRoot

from .contract import Case, Component, Contract

__all__ = ["ROOT"]


def describe(c: Contract, dut: SquareRoot) -> None:
    """The root is exact, rounded down, after as many clocks as it has digits."""
    digits = len(dut.root)
    radicand = c.keep(len(dut.radicand), name="radicand")
    eighth = c.keep(1, name="eighth")
    left = c.keep(range(digits + 1), name="digits_left")
    with c.m.If(c.rst):
        c.m.d.sync += [radicand.eq(0), eighth.eq(0), left.eq(0)]
    with c.m.Elif(dut.start):
        c.m.d.sync += [radicand.eq(dut.radicand >> dut.halve), eighth.eq(dut.eighth),
                       left.eq(Mux(dut.eighth, max(0, digits - 3), digits))]
    with c.m.Elif(left != 0):
        c.m.d.sync += left.eq(left - 1)
    whole = radicand << 2 * dut.fraction_bits
    number = Mux(eighth, whole >> 6, whole)
    made = (Mux(eighth, max(0, digits - 3), digits) - left)[:len(left)]
    done = number >> (left << 1)

    c.implication("root-is-exact", "The square of the root is not above the radicand, and that of "
                  "the next number is.", when=~dut.busy,
                  then=(dut.root * dut.root <= number)
                  & ((dut.root + 1) * (dut.root + 1) > number))
    c.invariant("a-digit-a-clock", "It is busy for as many clocks as there are digits.",
                dut.busy == (left != 0), cover=dut.busy & (left == 1))
    c.implication("root-stays", "The root stays until the next start.",
                  when=c.past(~dut.busy & ~dut.start & ~c.rst) & c.past(1),
                  then=~dut.busy & (dut.root == c.past(dut.root)))
    rest, below, to_come = c.signal("rest"), c.signal("below"), Mux(
        left + Mux(eighth, min(3, digits), 0) > dut.fraction_bits,
        (whole << (made << 1))[2 * dut.fraction_bits:2 * digits], 0)
    remains = rest + Mux(rest < 0, (dut.root << 1) + 1, 0)
    c.invariant("rest-is-what-is-missing", "What remains, and the square of the digits so far, are "
                "the digits of the radicand that were brought down.",
                (remains + dut.root * dut.root == done)
                & (remains >= 0) & (remains <= dut.root << 1), cover=left == 1, lemma=True)
    c.invariant("digits-to-come", "The other digits of the radicand wait in their place, those of "
                "a half a bit above it.",
                Mux(c.signal("halved"), Cat(below, c.signal("kept")) == to_come << 1,
                    below == to_come), cover=left == 1, lemma=True)
    c.invariant("counts-digits", "It counts the digits that are missing.",
                (c.signal("missing") == left) & (left <= digits), cover=left == 1, lemma=True)


ROOT = Component(
    make=SquareRoot, describe=describe, depth=13,
    cases=tuple(Case({"integer_bits": integer, "fraction_bits": fraction})
                for integer, fraction in [(3, 0), (2, 3), (4, 4), (5, 5)]))
