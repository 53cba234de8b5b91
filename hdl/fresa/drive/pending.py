"""Steps that were requested and are not made yet."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["PendingSteps"]


class PendingSteps(wiring.Component):
    """Keeps requested steps until a driver has made them; a step back cancels a step forward.

    Steps may be requested in any clock, whatever the driver's times are: the position at the pins
    and the count of pending steps together are always the position that was requested. So a
    reversal that is faster than the driver is made late, or not at all if it is taken back.

    A request reaches the driver a clock later.

    Parameters
    ----------
    width : int
        Bits of the signed count, from 2.

    Members
    -------
    step, direction : In(1)
        A step is requested: forward, or back.
    moved : In(1)
        The driver makes the step that is requested of it in this clock. Only with
        ``driver_step``.
    driver_step, driver_direction : Out(1)
        To the driver: a step is pending, and its direction.
    pending : Out(signed(width))
        Count of pending steps, forward less back.
    fault : Out(1)
        More were requested than the count can hold, and these are lost. It stays until a reset.

    Raises
    ------
    ValueError
        If ``width`` is not from 2 to 32.
    """

    def __init__(self, *, width: int = 4) -> None:
        self.width = in_range("width", width, 2, 32)
        super().__init__({
            "step": In(1), "direction": In(1), "moved": In(1),
            "driver_step": Out(1), "driver_direction": Out(1),
            "pending": Out(signed(self.width)), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        back = Signal()
        most = (1 << self.width - 1) - 1
        full = Signal()  # in the direction of the request
        away = Signal()  # the request leads further from what was made
        m.d.comb += [
            back.eq(self.pending[-1]),
            self.driver_step.eq(self.pending.any()),
            self.driver_direction.eq(~back),
            full.eq(Mux(self.direction, self.pending == most, self.pending == ~most)),
            away.eq(self.direction ^ back),
        ]
        # A step that is made leads towards 0, so it makes room for one that is requested.
        change = Signal(signed(3))
        with m.If(self.step & self.moved):
            m.d.comb += change.eq(Mux(away, 0, Mux(back, 2, -2)))
        with m.Elif(self.step):
            m.d.comb += change.eq(Mux(self.direction, 1, -1))
        with m.Elif(self.moved):
            m.d.comb += change.eq(Mux(back, 1, -1))
        with m.If(self.step & ~self.moved & full):
            m.d.sync += self.fault.eq(1)
        with m.Else():
            m.d.sync += self.pending.eq(self.pending + change)

        return m
