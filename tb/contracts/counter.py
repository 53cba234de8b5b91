"""Contract of the step counter."""

from fresa.motion import StepCounter

from .contract import Component, Contract

__all__ = ["COUNTER"]


def describe(c: Contract, dut: StepCounter) -> None:
    """Steps forward minus steps back, modulo 65 536, since the last clear or reset."""
    before = c.past(dut.count)
    stepped = c.past(dut.step & ~dut.clear & ~c.rst)
    up = c.past(dut.direction)
    c.implication("up", "A step with direction 1 counts one up, FFFF to 0000.",
                  when=stepped & up, then=dut.count == (before + 1)[:16])
    c.implication("down", "A step with direction 0 counts one down, 0000 to FFFF.",
                  when=stepped & ~up, then=dut.count == (before - 1)[:16])
    c.implication("clear", "After a clear or a reset the count is 0, steps or not.",
                  when=c.past(dut.clear | c.rst), then=dut.count == 0)
    c.implication("stays", "Without a step the count stays.",
                  when=c.past(~dut.step & ~dut.clear & ~c.rst), then=dut.count == before)

    total = c.keep(18, name="forward_less_back")
    with c.m.If(c.rst | dut.clear):
        c.m.d.sync += total.eq(0)
    with c.m.Elif(dut.step & dut.direction):
        c.m.d.sync += total.eq(total + 1)
    with c.m.Elif(dut.step):
        c.m.d.sync += total.eq(total - 1)
    c.invariant("forward-less-back", "The count is the steps forward less those back.",
                dut.count == total[:16], cover=total.all())


COUNTER = Component(make=lambda: StepCounter(), describe=describe)
