"""Contract of the coil driver, and what every contract with motors in it says of them."""

from amaranth import Cat, Mux, Signal, Value

from fresa.drive import FULL_STEP, CoilDriver, coil

from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["COIL", "coil_of", "is_neighbour", "phase_of", "watch_spacing"]


def phase_of(c: Contract, coils: Bits) -> tuple[Bits, Bits]:
    """Return the row of the motor's table that a coil word is, from 0, and whether it is one."""
    phase = Signal(2, name="watched_phase")
    legal = Signal(name="watched_legal")
    with c.m.Switch(coils):
        for row, word in enumerate(FULL_STEP):
            with c.m.Case(word):
                c.m.d.comb += [phase.eq(row), legal.eq(1)]
    return phase, legal


def coil_of(phase: Bits) -> Bits:
    """Return the coil word of a row of the motor's table."""
    word = Value.cast(FULL_STEP[0])
    for row in (1, 2, 3):
        word = Mux(phase == row, FULL_STEP[row], word)
    return word


def is_neighbour(before: Bits, after: Bits) -> Bits:
    """Say whether one coil changes its sign, with the one that is its opposite."""
    changed = before ^ after
    return (changed == 0b0101) | (changed == 0b1010)


def watch_spacing(c: Contract, moved: Bits, period: int, name: str = "rested") -> Bits:
    """Return how many clocks ago the last step was, less one; at most `period`."""
    rested = c.keep(range(period + 1), init=period, name=name)
    with c.m.If(moved):
        c.m.d.sync += rested.eq(0)
    with c.m.Elif(rested < period):
        c.m.d.sync += rested.eq(rested + 1)
    return rested


def describe(c: Contract, dut: CoilDriver) -> None:
    """A step is made when asked for, not too soon, and a step is a neighbour."""
    asked = Bug(coil, "self.step & rested & ~ResetSignal()", "rested & ~ResetSignal()")
    resets = Bug(coil, "self.step & rested & ~ResetSignal()", "self.step & rested")
    phase, legal = phase_of(c, dut.coils)
    before, moved, up = c.past(phase), c.past(dut.moved), c.past(dut.direction)
    word, was_reset = c.past(dut.coils, init=FULL_STEP[0]), c.past(c.rst)

    c.always("word-legal", "The coil word is one of the motor's table, from power-up.", legal,
             seen=phase == 3, bug=Bug(coil, "Cat(~orange, ~black, orange, black)",
                                      "Cat(~orange, black, orange, black)"))
    c.holds("starts-in-state-1", "Power-up sets the first row of the table.",
            when=~c.past(1), then=dut.coils == FULL_STEP[0],
            bug=Bug(coil, "init=FULL_STEP[0] >> 3 & 1", "init=1"))
    c.holds("forward", "A step with direction 1 goes one row down the table.",
            when=moved & up, then=phase == (before + 1)[:2],
            bug=Bug(coil, "black.eq(orange ^ self.direction)", "black.eq(orange)"))
    c.holds("back", "A step with direction 0 goes one row back.",
            when=moved & ~up, then=phase == (before - 1)[:2],
            bug=Bug(coil, "orange.eq(black ^ ~self.direction)", "orange.eq(black)"))
    c.holds("neighbour", "Where the word changes, one pair of coils changes.",
            when=word != dut.coils, then=is_neighbour(word, dut.coils),
            bug=Bug(coil, "orange.eq(black ^ ~self.direction)", "orange.eq(~orange)"))
    c.holds("only-on-a-step", "Where no step is made the word stays.",
            when=c.past(1) & ~moved, then=word == dut.coils,
            bug=Bug(coil, "with m.If(self.moved):\n            m.d.sync += [",
                    "with m.If(self.step):\n            m.d.sync += ["))
    c.holds("reset-keeps-the-word", "Reset changes no coil.",
            when=was_reset, then=word == dut.coils,
            bug=(resets, Bug(coil, "init=FULL_STEP[0] >> 2 & 1, reset_less=True",
                             "init=FULL_STEP[0] >> 2 & 1")))
    c.holds("asked", "A step is made only where one is asked for.",
            when=dut.moved, then=dut.step & ~c.rst, bug=(asked, resets))
    c.holds("moved-or-refused", "What is asked for is made or refused, and not both.",
            when=dut.step, then=dut.moved ^ dut.refused,
            bug=Bug(coil, "self.step & ~self.moved", "self.step & ~rested"))
    c.holds("refused-was-asked", "What nobody asked for is not refused.",
            when=dut.refused, then=dut.step & ~dut.moved,
            bug=Bug(coil, "self.step & ~self.moved", "~self.moved"))

    rested = watch_spacing(c, dut.moved, dut.period)
    c.holds("made-when-rested", "After `period` clocks a step asked for is made.",
            when=dut.step & (rested >= dut.period - 1) & ~c.rst, then=dut.moved,
            bug=Bug(coil, "self.step & rested & ~ResetSignal()",
                    "self.step & rested & ~ResetSignal() & self.direction"))
    if dut.period == 1:
        return
    rest = c.signal("rest")
    c.holds("spacing", "No step is made sooner than `period` clocks after the last, resets or not.",
            when=dut.moved, then=rested >= dut.period - 1,
            bug=(Bug(coil, "rest >= 0", "rest >= -1"),
                 Bug(coil, "init=0, reset_less=True)\n            m.d.comb += rested",
                     "init=0)\n            m.d.comb += rested")))
    c.holds("refused-too-soon", "A refusal has a cause: too soon, or reset.",
            when=dut.refused, then=c.rst | (rested < dut.period - 1),
            bug=Bug(coil, "with m.If(self.moved):\n                m.d",
                    "with m.If(self.step):\n                m.d"))
    c.always("rest-is-the-time", "The rest still to take is `period` less the clocks since.",
             rest == Mux(rested >= dut.period - 1, 0, rested - (dut.period - 1)),
             seen=Cat(rest).any(), bug=Bug(coil, "rest.eq(rest + 1)", "rest.eq(rest + 2)"))


COIL = Component(
    make=CoilDriver, describe=describe,
    cases=(*(Case({"period": period}) for period in (3, 2, 1)), Case({"period": 493_214},
                                                                     real=True)))
