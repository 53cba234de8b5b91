"""Contract of CoreXY: each step of an axis is made by both of its motors."""

from fresa.motion import CoreXY

from .contract import Case, Component, Contract

__all__ = ["CORE_XY"]


def describe(c: Contract, dut: CoreXY) -> None:
    """Counts of axes and motors keep to A = X + Y and B = X - Y."""
    busy = dut.busy
    x, y, a, b = (c.keep(8, name=f"count_{name}") for name in "xyab")
    c.assume(~busy | ~dut.step[1])
    for count, step, direction in ((x, dut.step[0], dut.direction[0]),
                                   (y, dut.step[1], dut.direction[1]),
                                   (a, dut.motor_step[0], dut.motor_direction[0]),
                                   (b, dut.motor_step[1], dut.motor_direction[1])):
        with c.m.If(step & direction):
            c.m.d.sync += count.eq(count + 1)
        with c.m.Elif(step):
            c.m.d.sync += count.eq(count - 1)
        with c.m.If(c.rst):
            c.m.d.sync += count.eq(0)
    known = ~c.past(0, init=1)
    c.implication("sum", "At rest A is X + Y.", when=known & ~busy, then=a == (x + y)[:8])
    c.implication("difference", "At rest B is X - Y.", when=known & ~busy, then=b == (x - y)[:8])
    c.implication("busy-a-clock", "A step is late only where two came at once, and by a clock if X "
                  "does not step again.",
                  when=busy & known & ~c.past(busy), then=c.past(dut.step[0] & dut.step[1]))
    c.implication("late-is-made", "It is made when X does not step.", when=busy & ~dut.step[0],
                  then=dut.motor_step[0] & dut.motor_step[1]
                  & (dut.motor_direction[0] != dut.motor_direction[1]))
    c.implication("third-axis", "Z has a motor of its own.", when=dut.step[2] | dut.motor_step[2],
                  then=dut.step[2] & dut.motor_step[2]
                  & (dut.direction[2] == dut.motor_direction[2]))
    late = c.signal("late_direction")
    c.invariant("late", "What is late is one step of Y.",
                ~known | ((a == (x + y - _sign(busy, late))[:8])
                          & (b == (x - y + _sign(busy, late))[:8])), cover=busy, lemma=True)


def _sign(busy, forward):
    """Return the step that is late: 1, -1, or 0."""
    return (busy & forward) - (busy & ~forward)


CORE_XY = Component(make=CoreXY, describe=describe, cases=(Case({}, real=False),), depth=8)
