"""Contract of the coil driver, and helpers of contracts with motors."""

from amaranth import Cat, Mux, Signal

from fresa.drive import FULL_STEP, CoilDriver

from .contract import Bits, Case, Component, Contract

__all__ = ["COIL", "is_neighbour", "phase_of", "watch_spacing"]


def phase_of(c: Contract, coils: Bits) -> tuple[Bits, Bits]:
    """Return the row of the motor's table that a coil word is, from 0, and whether it is one."""
    phase = Signal(2, name="watched_phase")
    legal = Signal(name="watched_legal")
    with c.m.Switch(coils):
        for row, word in enumerate(FULL_STEP):
            with c.m.Case(word):
                c.m.d.comb += [phase.eq(row), legal.eq(1)]
    return phase, legal


def is_neighbour(before: Bits, after: Bits) -> Bits:
    """Return whether one coil changes its sign, with the one that is its opposite."""
    changed = before ^ after
    return (changed == 0b0101) | (changed == 0b1010)


def watch_spacing(c: Contract, moved: Bits, period: int, name: str = "rested") -> Bits:
    """Return the clocks since the last step, minus one; at most `period`."""
    rested = c.keep(range(period + 1), init=period, name=name)
    with c.m.If(moved):
        c.m.d.sync += rested.eq(0)
    with c.m.Elif(rested < period):
        c.m.d.sync += rested.eq(rested + 1)
    return rested


def describe(c: Contract, dut: CoilDriver) -> None:
    """A step is made on request, not too soon, and to a neighbour in the table."""
    phase, legal = phase_of(c, dut.coils)
    before, moved, up = c.past(phase), c.past(dut.moved), c.past(dut.direction)
    word, was_reset = c.past(dut.coils, init=FULL_STEP[0]), c.past(c.rst)

    c.invariant("word-legal", "The coil word is one of the motor's table, from power-up.", legal,
                cover=phase == 3)
    c.implication("starts-in-state-1", "Power-up sets the first row of the table.",
                  when=~c.past(1), then=dut.coils == FULL_STEP[0])
    c.implication("forward", "A step with direction 1 goes one row down the table.",
                  when=moved & up, then=phase == (before + 1)[:2])
    c.implication("back", "A step with direction 0 goes one row back.",
                  when=moved & ~up, then=phase == (before - 1)[:2])
    c.implication("neighbour", "Where the word changes, one pair of coils changes.",
                  when=word != dut.coils, then=is_neighbour(word, dut.coils))
    c.implication("only-on-a-step", "Where no step is made the word stays.",
                  when=c.past(1) & ~moved, then=word == dut.coils)
    c.implication("reset-keeps-the-word", "Reset changes no coil.",
                  when=was_reset, then=word == dut.coils)
    c.implication("step-only-on-request", "A step is made only on request.",
                  when=dut.moved, then=dut.step & ~c.rst)
    c.implication("moved-or-refused", "A requested step is either made or refused.",
                  when=dut.step, then=dut.moved ^ dut.refused)
    c.implication("refused-only-on-request", "Without a request there is no refusal.",
                  when=dut.refused, then=dut.step & ~dut.moved)

    rested = watch_spacing(c, dut.moved, dut.period)
    c.implication("made-after-period", "After `period` clocks a requested step is made.",
                  when=dut.step & (rested >= dut.period - 1) & ~c.rst, then=dut.moved)
    if dut.period == 1:
        return
    rest = c.signal("rest")
    c.implication("spacing", "No step is made sooner than `period` clocks after the last, resets "
                             "or not.",
                  when=dut.moved, then=rested >= dut.period - 1)
    c.implication("refused-too-soon", "A refusal has a cause: too soon, or reset.",
                  when=dut.refused, then=c.rst | (rested < dut.period - 1))
    c.invariant("rest-is-time-left", "The register `rest` is `period` less the clocks since the "
                "last step.",
                rest == Mux(rested >= dut.period - 1, 0, rested - (dut.period - 1)),
                cover=Cat(rest).any())


COIL = Component(
    make=CoilDriver, describe=describe,
    cases=(*(Case({"period": period}) for period in (3, 2, 1)), Case({"period": 493_214},
                                                                     real=True)))
