"""Contract of the three motors side by side."""

from amaranth import Mux

from fresa.drive import FULL_STEP, AxisDrivers, axes, coil

from .coil import is_neighbour, phase_of, watch_spacing
from .contract import Bug, Case, Component, Contract

__all__ = ["AXES"]


def describe(c: Contract, dut: AxisDrivers) -> None:
    """Each axis does what a coil driver does, and nothing of what the others are told."""
    for index, (name, coils) in enumerate(
        [("x", dut.axis_x), ("y", dut.axis_y), ("z", dut.axis_z)]):
        phase, legal = phase_of(c, coils)
        step, moved, refused = dut.step[index], dut.moved[index], dut.refused[index]
        before, word = c.past(phase), c.past(coils, init=FULL_STEP[0])
        was_moved, up = c.past(moved), c.past(dut.direction[index])
        other = (index + 1) % 3
        rested = watch_spacing(c, moved, dut.period, f"rested_{name}")

        c.always(f"{name}-word-legal", f"The coil word of {name} is one of the motor's table.",
                 legal, seen=phase == 2,
                 bug=Bug(coil, "Cat(~orange, ~black, orange, black)",
                         "Cat(orange, ~black, orange, black)"))
        c.holds(f"{name}-moved-or-refused", f"A step asked of {name} is made or refused.",
                when=step, then=moved ^ refused,
                bug=Bug(axes, "driver.step.eq(self.step[index])",
                        f"driver.step.eq(self.step[index] & ~self.step[{other}])"))
        c.holds(f"{name}-not-asked", f"What nobody asks of {name} is neither made nor refused.",
                when=~step & dut.step.any(), then=~moved & ~refused,
                bug=Bug(axes, "driver.step.eq(self.step[index])",
                        "driver.step.eq(self.step.any())"))
        c.holds(f"{name}-not-in-reset", f"In reset no step of {name} is made.",
                when=c.rst & step, then=~moved,
                bug=Bug(coil, "self.step & rested & ~ResetSignal()", "self.step & rested"))
        c.holds(f"{name}-direction", f"A step of {name} goes the way that {name} was told.",
                when=was_moved, then=phase == (before + Mux(up, 1, -1))[:2],
                bug=Bug(axes, "self.direction[index]", f"self.direction[{other}]"))
        c.holds(f"{name}-neighbour", f"The word of {name} changes on a step, to a neighbour.",
                when=word != coils, then=was_moved & is_neighbour(word, coils),
                bug=Bug(axes, "self.moved[index].eq(driver.moved)",
                        f"self.moved[index].eq(driver.moved & self.step[{other}])"))
        c.holds(f"{name}-spacing", f"Two steps of {name} are never closer than `period` clocks.",
                when=moved, then=rested >= dut.period - 1,
                bug=Bug(axes, "period=self.period", "period=max(1, self.period - 1)"))
        if dut.period > 1:
            rest = c.signal(f"{name}.rest")
            c.always(f"{name}-rest-is-the-time",
                     f"The rest that {name} takes is the time it needs.",
                     (rest <= 0) & ((rest + dut.period - 1 == rested) | (rest == 0)) &
                     ((rest < 0) | (rested >= dut.period - 1)), seen=rest < 0,
                     bug=Bug(coil, "rest.eq(rest + 1)", "rest.eq(rest + 2)"))


AXES = Component(
    make=AxisDrivers, describe=describe,
    cases=(*(Case({"period": period}) for period in (3, 1)), Case({"period": 493_214}, real=True)))
