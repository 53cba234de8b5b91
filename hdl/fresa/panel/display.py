"""The four-digit 7-segment display."""

from amaranth import Array, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["HEX_SEGMENTS", "REFRESH", "SevenSegment", "scan_bits", "valid_scan_bits"]

HEX_SEGMENTS = (
    0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F, 0x77, 0x7C, 0x39, 0x5E, 0x79, 0x71,
)
"""Segments lit for 0 to F: a in bit 0 to g in bit 6."""

REFRESH = 60
"""Least rate at which all digits are shown, in Hz."""


def scan_bits(clock: int, refresh: int = REFRESH) -> int:
    """Return the ``scan_bits`` for a display refreshed at so many Hz or more, at a clock in Hz.

    Raises
    ------
    ValueError
        If the clock is too slow for that.
    """
    in_range("refresh", refresh, 1, clock // 32)
    return (clock // (4 * refresh)).bit_length() - 1


def valid_scan_bits(value: object) -> int:
    """Return `value` if it is a valid time slot of a digit, else raise ValueError."""
    return in_range("scan_bits", value, 3, 24)


class SevenSegment(wiring.Component):
    """Shows a 16-bit number as four hexadecimal digits, time-multiplexed.

    A digit has a time slot of ``2 ** scan_bits`` clocks. In the first and the last eighth of a slot
    all anodes are off, and the segments change between them: slow anode drivers have switched off
    by then, so no digit ghosts onto the next.

    Parameters
    ----------
    scan_bits : int
        Binary logarithm of the clocks of a slot, from 3 to 24.

    Members
    -------
    value : In(16)
        Number to show.
    enable : In(1)
        The display is dark without it.
    segments : Out(8)
        Cathodes, active low: a to g, then the point, from bit 0. The point is never lit.
    digits : Out(4)
        Anodes, active low: bit 0 is the rightmost digit, the least significant.

    Raises
    ------
    ValueError
        If ``scan_bits`` is out of range.
    """

    value: In(16)
    enable: In(1)
    segments: Out(8, init=0xFF)
    digits: Out(4, init=0xF)

    def __init__(self, *, scan_bits: int) -> None:
        self.scan_bits = valid_scan_bits(scan_bits)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        time = Signal(self.scan_bits + 2)
        m.d.sync += time.eq(time + 1)
        digit = time[self.scan_bits:]
        eighth = time[self.scan_bits - 3:self.scan_bits]
        lit = Signal()
        m.d.comb += lit.eq(self.enable & eighth.any() & ~eighth.all())

        nibble = Signal(4)
        shape = Signal(8)
        m.d.comb += [
            nibble.eq(self.value.word_select(digit, 4)),
            shape.eq(Array(HEX_SEGMENTS)[nibble]),
            self.segments.eq(~shape),
            self.digits.eq(~(lit << digit)),
        ]

        return m
