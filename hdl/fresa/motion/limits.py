"""Switches at the ends of axes."""

from amaranth import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import MAX_PERIOD, FrequencyDivider

__all__ = ["Limits"]


class Limits(wiring.Component):
    """Blocks steps towards a limit switch that is on, and passes those away from it.

    It stands between the source of step requests and the drivers of the motors, with no latency:
    from the clock in which a switch is seen, no step towards it passes. Positions count what the
    drivers make, so a blocked step is not counted.

    Contacts bounce, both when they close and when they open. A switch counts as on for ``period``
    clocks after it was last seen on, and for at most twice as long. A glitch only delays steps.

    Reset changes nothing.

    Parameters
    ----------
    axes : int
        Number of axes, from 1 to 64.
    period : int
        Time in which a contact settles, in clocks, from 1 to ``MAX_PERIOD``.

    Members
    -------
    step, direction : In(axes)
        Step requests, a bit an axis; direction 1 leads to the high end.
    low, high : In(axes)
        The switch at that end is pressed. Synchronous to the clock.
    allowed : Out(axes)
        Step requests that pass.
    at_low, at_high : Out(axes)
        The switch at that end counts as on.

    Raises
    ------
    ValueError
        If ``axes`` or ``period`` is out of range.
    """

    def __init__(self, *, axes: int, period: int) -> None:
        self.axes = in_range("axes", axes, 1, 64)
        self.period = in_range("limits period", period, 1, MAX_PERIOD)
        super().__init__(
            {name: In(axes) for name in ("step", "direction", "low", "high")}
            | {name: Out(axes) for name in ("allowed", "at_low", "at_high")})

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.divider = divider = FrequencyDivider(period=self.period, reset_less=True)
        m.d.comb += divider.enable.eq(1)

        on = Cat(self.low, self.high)
        since = Signal.like(on, reset_less=True)  # on since the last tick
        before = Signal.like(on, reset_less=True)  # on between the two ticks before
        with m.If(divider.tick):
            m.d.sync += [before.eq(since | on), since.eq(0)]
        with m.Else():
            m.d.sync += since.eq(since | on)

        m.d.comb += [
            Cat(self.at_low, self.at_high).eq(on | since | before),
            self.allowed.eq(self.step & ~(
                self.direction & self.at_high | ~self.direction & self.at_low)),
        ]

        return m
