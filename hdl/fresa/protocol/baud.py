"""How long a bit of a serial line takes."""

from ..checks import in_range
from ..drive import MAX_PERIOD

__all__ = ["BAUD", "LEAST_PERIOD", "MAX_CLOCK", "bit_period", "valid_bit"]

BAUD = 9600
"""Bits a second of all lines, unless told otherwise."""

LEAST_PERIOD = 16
"""Clocks of the shortest bit: it must be possible to look into its middle three times."""

MAX_CLOCK = 10**9
"""Highest clock rate that is believed, in Hz."""


def bit_period(clock: int, baud: int) -> int:
    """Return the number of clocks that comes nearest to a bit.

    A byte is ten bits long, and who receives it looks last into the middle of its tenth. A rate
    that is 2 % off leaves the other side another 1.9 %.

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
    """Return the clocks of a bit if there can be so many, else raise ValueError."""
    return in_range("period", period, LEAST_PERIOD, MAX_PERIOD)
