"""Contract of the positioner: what its motors never do, whatever its registers hold.

Commands come as slow as a serial line, too slow to be waited for here; so each promise is about one
clock and the next, and is kept from any values of all registers, also of upset ones. What takes
longer is promised by the parts: see `positioning`, `axis` and `positioner_commands`.
"""

from fresa.machines import Positioner, positioner
from fresa.machines.positioner import PositionerPace

from .contract import Bug, Case, Component, Contract

__all__ = ["POSITIONER"]


def describe(c: Contract, dut: Positioner) -> None:
    """A step leaves a pin only where a movement is ordered, power is on, and no switch is ahead."""
    known = c.past(1)
    orders = c.part("positioning")
    for index, name in enumerate("xyz"):
        axis = c.part(name)
        step, up = dut.step[index], dut.direction[index]
        rises = known & step & ~c.past(step)
        c.holds(f"{name}-moves-by-order", f"STEP of {name} rises only where {name} has a movement, "
                "and in no reset.", when=rises, then=c.past(dut.moving[index] & ~c.rst),
                upset=True, bug=Bug(positioner, "axis.run.eq(positioning.run[index] & ~self.fault)",
                                    "axis.run.eq(~self.fault)"))
        c.holds(f"{name}-is-connected", f"STEP of {name} rises only while connected.", when=rises,
                then=c.past(dut.connected), upset=True,
                bug=Bug(positioner, "axis.enable.eq(positioning.connected)", "axis.enable.eq(1)"))
        c.holds(f"{name}-stops-at-its-limit", f"Clockwise no step of {name} is made from the clock "
                "in which its limit is seen.", when=c.past(dut.limits[index]) & rises,
                then=~up, upset=True,
                bug=Bug(positioner, 'axis.high.eq(pressed.get(f"{name.upper()}+", 0))',
                        "axis.high.eq(0)"))
        c.holds(f"{name}-goes-its-way", f"DIR of {name} is that of its target when STEP rises.",
                when=rises, then=up == c.past(orders.target[index] > axis.position), upset=True,
                bug=Bug(positioner, "axis.target.eq(positioning.target[index])",
                        "axis.target.eq(positioning.numbers[index])"))
        change = axis.position - c.past(axis.position)
        c.holds(f"{name}-counts-its-steps", f"The position of {name} changes by one, where STEP "
                "rises, its way, or is called otherwise by POS, ORIGIN or reset.",
                when=known & (change != 0) & ~c.past(orders.load | c.rst),
                then=rises & ((change == 1) & up | (change == -1) & ~up), upset=True,
                bug=Bug(positioner, "axis.load.eq(positioning.load)",
                        "axis.load.eq(reporter.tick)"))
    c.holds("fault-holds", "While a fault shows no step begins.",
            when=known & c.past(dut.fault), then=(dut.step & ~c.past(dut.step)) == 0, upset=True,
            bug=Bug(positioner, "axis.run.eq(positioning.run[index] & ~self.fault)",
                    "axis.run.eq(positioning.run[index])"))
    c.holds("power", "ENABLE follows CONNECT and DISCONNECT: where it comes on, one is connected.",
            when=known & (dut.enable & ~c.past(dut.enable)).any(), then=c.past(dut.connected),
            upset=True, bug=Bug(positioner, "axis.enable.eq(positioning.connected)",
                                "axis.enable.eq(1)"))


def make(**pace: int) -> Positioner:
    """Make a machine of its times."""
    return Positioner(pace=PositionerPace(**pace))


POSITIONER = Component(
    make=make, describe=describe, depth=4,
    cases=(Case({"clock": 16_000, "baud": 1000, "top_speed": 1500, "width": 2, "low": 2,
                 "setup": 2, "hold": 2, "settle": 3, "report": 10_000}, upset=True),))
