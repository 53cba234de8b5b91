"""The two motors of a gantry, each to its own limit switch."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MotorSquaring"]


class MotorSquaring(wiring.Component):
    """Halts each of the two motors of an axis at its own switch, while the axis seeks them.

    A motor is halted from the clock after its switch is on until ``seeks`` ends, also if the switch
    is off again, as one that is met with a jolt may be. The other one goes on alone, which skews
    the gantry if it was square: not for more than ``most`` steps, beyond which ``failed`` is 1.

    Parameters
    ----------
    width : int
        Bits of a number of steps, from 1 to 64.

    Members
    -------
    seeks : In(1)
        The axis seeks its switches, or brakes after it has found them.
    switches : In(2)
        The switch of each motor, 1 while it is on.
    moved : In(1)
        A step is made by the motors that are not halted.
    most : In(width)
        Most steps that one motor makes alone.
    halt : Out(2)
        Motors that are halted.
    failed : Out(1)
        One has made more steps alone. It is 1 from the second clock after the first of these, until
        both are halted or ``seeks`` ends.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int) -> None:
        self.width = in_range("width", width, 1, 64)
        super().__init__({"seeks": In(1), "switches": In(2), "moved": In(1), "most": In(width),
                          "halt": Out(2), "failed": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        alone = Signal()
        count = Signal(self.width + 1)  # with room for those that are made before `failed` is seen
        m.d.comb += alone.eq(self.halt.any() & ~self.halt.all() & self.seeks)
        m.d.sync += [self.halt.eq((self.halt | self.switches) & self.seeks.replicate(2)),
                     self.failed.eq(alone & (count > self.most))]
        with m.If(~alone):
            m.d.sync += count.eq(0)
        with m.Elif(self.moved & (count <= self.most)):
            m.d.sync += count.eq(count + 1)
        return m
