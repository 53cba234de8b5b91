"""Contract of the milling machine: all of it, on its pins."""

from fresa.machines import Mill
from fresa.machines.mill import MillTiming
from tb.contracts.automatic import watch_counts
from tb.contracts.contract import Case, Component, Contract
from tb.contracts.controller import Pins, watch_machine, watch_parts
from tb.contracts.display import watch_display
from tb.contracts.monitor import watch_leds
from tb.contracts.order_control import watch_order

__all__ = ["MILL"]


def describe(c: Contract, dut: Mill) -> None:
    """What people rely on, and the invariants of what is inside."""
    coils = (dut.axis_x, dut.axis_y, dut.axis_z)
    controller = c.part("controller")
    watch_machine(c, Pins(mode=dut.mode, stop=dut.stop, jog=dut.jog, ready=dut.ready,
                          error=dut.error, count=dut.count, select=dut.counter_select,
                          coils=coils), period=controller.period, path="controller")
    watch_order(c, "controller.automatic.orders", reset=c.rst | ~dut.mode)
    watch_counts(c, "controller.automatic", reset=c.rst | ~dut.mode)
    watch_parts(c, "controller", mode=dut.mode)
    watch_leds(c, mode=dut.mode, leds=dut.leds, jogging=controller.jogging, coils=coils)
    watch_display(c, "monitor.display", segments=dut.segments, digits=dut.digits, value=dut.count,
                  enable=dut.mode)


def make(*, z_travel: int, **timing: int) -> Mill:
    """Make a machine of its times."""
    return Mill(timing=MillTiming(**timing), z_travel=z_travel)


MILL = Component(
    make=make, describe=describe, depth=26,
    cases=(Case({"period": 3, "scan_bits": 3, "z_travel": 2}),
           Case({"period": 1, "scan_bits": 3, "z_travel": 1}),
           Case({"period": 493_214, "scan_bits": 17, "z_travel": 1152}, real=True),
           Case({"period": 3, "scan_bits": 3, "z_travel": 2}, upset=True)))
