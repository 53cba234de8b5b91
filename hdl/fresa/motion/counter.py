"""Counting steps."""

from amaranth import Module, Mux
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["StepCounter"]


class StepCounter(wiring.Component):
    """Cyclic 16-bit counter: FFFF + 1 = 0000, and back.

    *Contador de Pasos* (thesis, 4.1.6). There each counter has a divider of its own so that it can
    never run ahead of its motor; here it counts the steps that the coil driver makes, so that the
    two cannot differ. The count changes with the clock edge that moves the coils.

    Members
    -------
    step : In(1)
        A step is made in this clock.
    direction : In(1)
        1 counts up, 0 down.
    clear : In(1)
        Count from 0. A step in the same clock is not counted.
    count : Out(16)
        Steps forward less steps back since the last clear or reset, modulo 65 536.
    """

    step: In(1)
    direction: In(1)
    clear: In(1)
    count: Out(16)

    def elaborate(self, platform) -> Module:
        m = Module()

        with m.If(self.clear):
            m.d.sync += self.count.eq(0)
        with m.Elif(self.step):
            m.d.sync += self.count.eq(self.count + Mux(self.direction, 1, -1))

        return m
