"""Contract of the three motors side by side."""

from amaranth import Mux

from fresa.drive import FULL_STEP, AxisDrivers

from .coil import is_neighbour, phase_of, watch_spacing
from .contract import Case, Component, Contract

__all__ = ["AXES"]


def describe(c: Contract, dut: AxisDrivers) -> None:
    """Each axis behaves like a coil driver, and independently of the requests to the others."""
    for index, (name, coils) in enumerate(
        [("x", dut.axis_x), ("y", dut.axis_y), ("z", dut.axis_z)]):
        phase, legal = phase_of(c, coils)
        step, moved, refused = dut.step[index], dut.moved[index], dut.refused[index]
        before, word = c.past(phase), c.past(coils, init=FULL_STEP[0])
        was_moved, up = c.past(moved), c.past(dut.direction[index])
        rested = watch_spacing(c, moved, dut.period, f"rested_{name}")

        c.invariant(f"{name}-word-legal", f"The coil word of {name} is one of the motor's table.",
                    legal, cover=phase == 2)
        c.implication(f"{name}-moved-or-refused", f"A requested step of {name} is made or refused.",
                      when=step, then=moved ^ refused)
        c.implication(f"{name}-only-on-request", f"Without a request no step of {name} is made or "
                      "refused.", when=~step & dut.step.any(), then=~moved & ~refused)
        c.implication(f"{name}-not-in-reset", f"In reset no step of {name} is made.",
                      when=c.rst & step, then=~moved)
        c.implication(f"{name}-direction", f"A step of {name} has the requested direction.",
                      when=was_moved, then=phase == (before + Mux(up, 1, -1))[:2])
        c.implication(f"{name}-neighbour", f"The word of {name} changes on a step, to a neighbour.",
                      when=word != coils, then=was_moved & is_neighbour(word, coils))
        c.implication(f"{name}-spacing", f"Two steps of {name} are never closer than `period` "
                      "clocks.", when=moved, then=rested >= dut.period - 1)
        if dut.period > 1:
            rest = c.signal(f"{name}.rest")
            c.invariant(f"{name}-rest-is-time-left",
                        f"The register `rest` of {name} is the time until it is ready.",
                        (rest <= 0) & ((rest + dut.period - 1 == rested) | (rest == 0)) &
                        ((rest < 0) | (rested >= dut.period - 1)), cover=rest < 0)


AXES = Component(
    make=AxisDrivers, describe=describe,
    cases=(*(Case({"period": period}) for period in (3, 1)), Case({"period": 493_214}, real=True)))
