"""Contract of two driver modules: each step is made by both motors, or by neither."""

from amaranth import Cat

from fresa.drive import StepDirPair

from .contract import Component, Contract
from .step_dir import STEP_DIR

__all__ = ["STEP_DIR_PAIR"]


def describe(c: Contract, dut: StepDirPair) -> None:
    """Relate the two; the times at the pins are those of the contract of each driver."""
    known = c.past(1)
    moved = c.past(dut.moved)
    if dut.adjustable:
        c.assume((dut.width_now >= 1) & (dut.width_now <= dut.width))
    for name, step_pin, direction_pin, halt in (
            ("first", dut.step_pin, dut.direction_pin, dut.halt[0]),
            ("second", dut.second_step_pin, dut.second_direction_pin, dut.halt[1])):
        rises = step_pin & ~c.past(step_pin)
        with c.each(name):
            c.invariant("made-together", "STEP rises in the clock after a step is made, and at no "
                        "other time, unless the motor was halted.",
                        rises == (moved & ~c.past(halt)), cover=rises)
            c.implication("direction-as-requested", "It rises with DIR as requested.", when=rises,
                          then=direction_pin == c.past(dut.direction))
            c.implication("halted-direction-stays", "DIR of a motor that is halted stays.",
                          when=known & c.past(halt), then=direction_pin == c.past(direction_pin))
    c.implication("step-only-on-request", "A step is made only where it is requested, not in a "
                  "reset, and only by a motor that is not halted.", when=dut.moved,
                  then=dut.step & ~c.rst & ~dut.halt.all())
    c.implication("step-only-with-power", "It is made only where both motors have power, or are "
                  "halted.", when=dut.moved,
                  then=dut.enable & (dut.enable_pin | dut.halt.any()))

    first, second = c.part("first"), c.part("second")
    halts = tuple(zip((first, second), dut.halt, strict=True))
    c.implication("ready-implies-step", "When each driver is ready whose motor is not halted, a "
                  "requested step is made.",
                  when=dut.step & ~c.rst & ~dut.halt.all()
                  & Cat(each.ready | halt for each, halt in halts).all(), then=dut.moved)
    c.invariant("direction-is-turned", "A driver that is not ready is requested the step, too, "
                "which turns its DIR.",
                Cat(~dut.step | halt | each.ready | each.step for each, halt in halts).all(),
                cover=dut.step & ~first.ready & ~dut.halt.any())

    # While the drivers are alike each is offered the steps that are offered to the pair.
    halted = c.keep(1, name="halted")  # before this clock
    c.m.d.sync += halted.eq(halted | dut.halt.any())
    c.invariant("alike", "Until a motor is halted both drivers are in the same state.",
                halted | ((c.signal("first.high") == c.signal("second.high"))
                          & (c.signal("first.sense") == c.signal("second.sense"))
                          & (c.signal("first.power") == c.signal("second.power"))
                          & (c.signal("first.wait") == c.signal("second.wait"))),
                cover=~halted & dut.step_pin)
    c.invariant("as-one-driver", "Until then each driver is requested what the pair is, and makes "
                "it when the pair does.",
                halted | dut.halt.any()
                | ((first.step == dut.step) & (second.step == dut.step)
                   & (first.moved == dut.moved)),
                cover=~halted & dut.moved)
    c.keeps("first", STEP_DIR)
    c.keeps("second", STEP_DIR)


STEP_DIR_PAIR = Component(make=StepDirPair, describe=describe, cases=STEP_DIR.cases,
                          depth=STEP_DIR.depth)
