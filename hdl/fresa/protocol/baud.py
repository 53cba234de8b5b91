"""Bit periods of serial lines."""

from ..checks import in_range
from ..drive import MAX_PERIOD

__all__ = ["BAUD", "LEAST_PERIOD", "MAX_CLOCK", "bit_period", "valid_bit"]

BAUD = 9600
"""Default bit rate, in bits/s."""

LEAST_PERIOD = 16
"""Clocks of the shortest bit: the receiver takes three samples around its middle."""

MAX_CLOCK = 10**9
"""Highest valid clock frequency, in Hz."""


def bit_period(clock: int, baud: int) -> int:
    """Return the number of clocks that comes nearest to a bit.

    A byte is ten bits long, and a receiver samples the tenth in its middle. The bits of a sender
    may be 5.2 % longer than those of `UARTReceiver`, or 3.8 % shorter, whatever the period: a rate
    error of 2 % here leaves 1.8 % to the other side.

    Parameters
    ----------
    clock : int
        Clock rate in Hz.
    baud : int
        Bits a second.

    Raises
    ------
    ValueError
        If a bit is shorter than ``LEAST_PERIOD`` clocks or longer than ``MAX_PERIOD``, or if no
        whole number of clocks comes within 2 % of the rate.
    """
    clock = in_range("clock", clock, LEAST_PERIOD, MAX_CLOCK)
    slowest, fastest = -(-clock // MAX_PERIOD), clock // LEAST_PERIOD
    baud = in_range(f"baud at a clock of {clock} Hz", baud, slowest, fastest)
    period = (2 * clock + baud) // (2 * baud)
    if 50 * abs(clock - period * baud) > period * baud:
        raise ValueError(
            f"baud {baud} cannot be had from a clock of {clock} Hz: {period} clocks a bit "
            f"are {clock / period:.0f} baud, more than 2 % off")
    return period


def valid_bit(period: int) -> int:
    """Return `period` if it is a valid number of clocks of a bit, else raise ValueError."""
    return in_range("period", period, LEAST_PERIOD, MAX_PERIOD)
