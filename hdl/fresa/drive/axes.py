"""The three motors side by side."""

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .coil import CoilDriver
from .divider import valid_period

__all__ = ["AxisDrivers"]


class AxisDrivers(wiring.Component):
    """Three coil drivers: X, Y and Z from bit 0.

    *Intérprete de Órdenes* (thesis, 4.1.4). Adds nothing to :class:`CoilDriver` and takes no time.

    Parameters
    ----------
    period : int
        Least number of clocks between two steps of one axis.

    Members
    -------
    step, direction : In(3)
        Step requests, a bit an axis, and their directions.
    moved, refused : Out(3)
        As of :class:`CoilDriver`, a bit an axis.
    axis_x, axis_y, axis_z : Out(4)
        Coil words.
    """

    step: In(3)
    direction: In(3)
    moved: Out(3)
    refused: Out(3)
    axis_x: Out(4)
    axis_y: Out(4)
    axis_z: Out(4)

    def __init__(self, *, period: int) -> None:
        self.period = valid_period(period)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        for index, (name, coils) in enumerate(
            [("x", self.axis_x), ("y", self.axis_y), ("z", self.axis_z)]):
            m.submodules[name] = driver = CoilDriver(period=self.period)
            m.d.comb += [
                driver.step.eq(self.step[index]),
                driver.direction.eq(self.direction[index]),
                self.moved[index].eq(driver.moved),
                self.refused[index].eq(driver.refused),
                coils.eq(driver.coils),
            ]

        return m
