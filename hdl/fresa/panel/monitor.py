"""LEDs and display of the mill."""

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .display import SevenSegment, valid_scan_bits

__all__ = ["Monitor"]


class Monitor(wiring.Component):
    """LEDs in manual mode, the display in automatic mode; the other is dark.

    *Monitorización* (thesis, 4.2.1).

    Parameters
    ----------
    scan_bits : int
        See :class:`SevenSegment`.

    Members
    -------
    mode : In(1)
        0 manual, 1 automatic.
    axis_x, axis_y, axis_z : In(4)
        Coil words.
    jogging : In(3)
        Axes that are jogged.
    count : In(16)
        Count to show.
    leds : Out(4)
        Coil word of the axis that moves, X before Y before Z; X's when none moves.
    segments, digits : Out(8), Out(4)
        See :class:`SevenSegment`.
    """

    mode: In(1)
    axis_x: In(4)
    axis_y: In(4)
    axis_z: In(4)
    jogging: In(3)
    count: In(16)
    leds: Out(4)
    segments: Out(8)
    digits: Out(4)

    def __init__(self, *, scan_bits: int) -> None:
        self.scan_bits = valid_scan_bits(scan_bits)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.display = display = SevenSegment(scan_bits=self.scan_bits)
        x, y, z = self.jogging
        show_y = Signal()
        show_z = Signal()
        m.d.comb += [show_y.eq(~x & y), show_z.eq(~x & ~y & z)]
        word = Mux(show_z, self.axis_z, Mux(show_y, self.axis_y, self.axis_x))
        m.d.comb += [
            self.leds.eq(Mux(self.mode, 0, word)),
            display.value.eq(self.count),
            display.enable.eq(self.mode),
            self.segments.eq(display.segments),
            self.digits.eq(display.digits),
        ]

        return m
