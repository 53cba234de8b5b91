"""`mill`: the three-axis milling machine of the thesis."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..clock import CLOCK
from ..drive import MAX_PERIOD
from ..motion import GuardedController, NumericalController
from ..panel import Monitor, debounce_period, scan_bits
from ..panel.display import REFRESH

__all__ = ["PIXEL_STEPS", "PICTURE_MAX", "RESOLUTION", "STOP_TIME", "TOP_SPEED", "Z_TRAVEL", "Mill",
           "MillTiming", "step_period"]

RESOLUTION = Fraction(125, 100) / 6 / 48
"""Travel of a step, in mm: screw pitch / reduction / steps of a turn (thesis, 3.3)."""

TOP_SPEED = Fraction("101.376")
"""Most steps a second that the motors follow: 26.4 mm/min (thesis, 3.3)."""

Z_TRAVEL = 1152
"""Steps between the raised and the lowered tool: 5.0 mm."""

PIXEL_STEPS = 128
"""Steps of a pixel: its 9-bit number is the high part of a 16-bit position (thesis, 5.4)."""

PICTURE_MAX = 400
"""Most rows and columns of a picture (thesis, 5.4)."""

STOP_TIME = Fraction(10, 10**6)
"""Time for which the stop button must be steady, in seconds."""


def step_period(step_rate: Fraction | float | str, clock: int = CLOCK) -> int:
    """Clocks from one step to the next, such that the motors never go faster than `step_rate`.

    Parameters
    ----------
    step_rate : number or str
        Steps a second. A float is taken for the shortest decimal number that it prints as.
    clock : int
        Clock in Hz.

    Raises
    ------
    ValueError
        If there is no such number of clocks: the rate is over `clock`, or takes over
        ``MAX_PERIOD``.
    """
    try:
        # As a float first: it is quick to see that 1e999999 is too much.
        rate = Fraction(str(step_rate)) if 0 < float(step_rate) < 1e12 else Fraction(0)
    except ValueError:
        rate = Fraction(0)
    if not Fraction(clock, MAX_PERIOD) <= rate <= clock:
        raise ValueError(f"step rate must be from {clock / MAX_PERIOD:.3f} to {clock} steps/s, "
                         f"not {step_rate!r}")
    return ceil(clock / rate)


@dataclass(frozen=True)
class MillTiming:
    """Times of the machine, in clocks.

    A board sets it from physical units with :meth:`real`. A simulation may shorten every time
    without another change to the gateware.

    Attributes
    ----------
    period : int
        Least clocks between two steps of an axis.
    scan_bits : int
        Binary logarithm of the clocks of a digit's time slot on the display.
    jog_period : int
        Clocks from one step request by hand to the next.
    stop_period : int
        Clocks for which the stop button of a :class:`MillStation` must be steady.
    """

    period: int
    scan_bits: int
    jog_period: int = 1
    stop_period: int = 1

    @classmethod
    def real(cls, *, step_rate: Fraction | float | str = TOP_SPEED, clock: int = CLOCK,
             refresh: int = REFRESH) -> "MillTiming":
        """Return the timing for so many steps/s, and a display refreshed at so many Hz or more.

        Raises
        ------
        ValueError
            If the clock is too slow or too fast for them.
        """
        return cls(period=step_period(step_rate, clock), scan_bits=scan_bits(clock, refresh),
                   stop_period=debounce_period(clock, STOP_TIME))


class Mill(wiring.Component):
    """Three-axis milling machine, without a board: the pins of the thesis.

    All inputs are synchronous to the clock and clean.

    Parameters
    ----------
    timing : MillTiming
        Times, in clocks.
    z_travel : int
        Steps between the raised and the lowered tool.
    guard : bool
        Duplicate the controller and compare, so that no upset flip-flop of it leads to a wrong
        position without ``error``: see :class:`GuardedController`. Takes twice the logic.

    Members
    -------
    mode : In(1)
        0 manual, 1 automatic.
    position_x, position_y : In(16)
        Target in steps, row and column.
    up, down : In(1)
        The order is to raise or lower the tool.
    start : In(1)
        Takes the order if ``ready``. Must fall before it counts again.
    counter_select : In(2)
        Count to show: 0 main, 1 X, 2 Y, 3 Z.
    jog : In(6)
        x up, x down, y up, y down, z up, z down from bit 0.
    stop : In(1)
        From here on no step is made and ``ready`` stays low, until reset.
    ready, error : Out(1)
        An order may come; an order was refused, or a state register was upset. With ``guard`` also:
        a position may be wrong; then no step is made until reset.
    axis_x, axis_y, axis_z : Out(4)
        Coil words.
    leds : Out(4)
        Coil word of the axis that is jogged.
    count : Out(16)
        The count chosen.
    segments, digits : Out(8), Out(4)
        The display, active low.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    mode: In(1)
    position_x: In(16)
    position_y: In(16)
    up: In(1)
    down: In(1)
    start: In(1)
    counter_select: In(2)
    jog: In(6)
    stop: In(1)
    ready: Out(1)
    error: Out(1)
    axis_x: Out(4)
    axis_y: Out(4)
    axis_z: Out(4)
    leds: Out(4)
    count: Out(16)
    segments: Out(8)
    digits: Out(4)

    def __init__(self, *, timing: MillTiming | None = None, z_travel: int = Z_TRAVEL,
                 guard: bool = False) -> None:
        timing = timing or MillTiming.real()
        self._controller = (GuardedController if guard else NumericalController)(
            period=timing.period, jog_period=timing.jog_period, z_travel=z_travel)
        self._monitor = Monitor(scan_bits=timing.scan_bits)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.controller = controller = self._controller
        m.submodules.monitor = monitor = self._monitor
        m.d.comb += [
            controller.mode.eq(self.mode),
            controller.order.x.eq(self.position_x),
            controller.order.y.eq(self.position_y),
            controller.order.up.eq(self.up),
            controller.order.down.eq(self.down),
            controller.start.eq(self.start),
            controller.jog.eq(self.jog),
            controller.stop.eq(self.stop),
            controller.select.eq(self.counter_select),
            self.ready.eq(controller.ready),
            self.error.eq(controller.error),
            self.axis_x.eq(controller.axis_x),
            self.axis_y.eq(controller.axis_y),
            self.axis_z.eq(controller.axis_z),
            self.count.eq(controller.count),

            monitor.mode.eq(self.mode),
            monitor.axis_x.eq(controller.axis_x),
            monitor.axis_y.eq(controller.axis_y),
            monitor.axis_z.eq(controller.axis_z),
            monitor.jogging.eq(controller.jogging),
            monitor.count.eq(controller.count),
            self.leds.eq(monitor.leds),
            self.segments.eq(monitor.segments),
            self.digits.eq(monitor.digits),
        ]

        return m
