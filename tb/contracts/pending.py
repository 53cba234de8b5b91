"""Contract of pending steps."""

from amaranth import Mux, signed

from fresa.drive import PendingSteps

from .contract import Case, Component, Contract

__all__ = ["PENDING"]


def describe(c: Contract, dut: PendingSteps) -> None:
    """What was requested is at the pins, or pending: no step is lost, and none is added."""
    c.assume(~dut.moved | dut.driver_step)  # a driver makes what is requested
    forward = dut.driver_direction
    # Requested position less that at the pins, with room for one that the count has not.
    gap = c.keep(signed(dut.width + 1), name="gap")
    c.m.d.sync += gap.eq(Mux(c.rst, 0, gap + Mux(dut.step, Mux(dut.direction, 1, -1), 0)
                             - Mux(dut.moved, Mux(forward, 1, -1), 0)))
    least = -(1 << dut.width - 1)
    c.implication("no-lost-step", "The position at the pins and the pending steps are the "
                  "requested position, unless there is a fault.", when=~dut.fault,
                  then=dut.pending == gap)
    c.invariant("requests-pending-steps", "A step is requested of the driver while one is pending.",
                dut.driver_step == (dut.pending != 0), cover=~dut.driver_step)
    c.implication("towards-requested", "Each step leads towards the requested position.",
                  when=dut.driver_step, then=forward == (dut.pending > 0))
    request = c.past(dut.step & ~c.rst)
    forth, count = c.past(dut.direction), c.past(dut.pending)
    c.implication("fault-only-when-full", "There is a fault only where the count is at its end, "
                  "and another step that way is requested.",
                  when=dut.fault & ~c.past(dut.fault), then=request
                  & (count == Mux(forth, ~least, least)))
    c.implication("fault-stays", "A fault stays until a reset.",
                  when=c.past(dut.fault & ~c.rst), then=dut.fault)
    c.implication("reset", "After a reset no step is pending.", when=c.past(c.rst),
                  then=(dut.pending == 0) & ~dut.fault)


PENDING = Component(
    make=PendingSteps, describe=describe, depth=12,
    cases=(Case({"width": 2}), Case({"width": 3}), Case({"width": 4}, real=True)))
