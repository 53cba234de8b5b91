"""The clock that machines have unless they are given another, and times in clocks."""

from .checks import in_range

__all__ = ["CLOCK", "clocks_of"]

CLOCK = 50_000_000
"""In Hz: that of the thesis's board."""


def clocks_of(name: str, time: int, units: int, *, clock: int, most: int) -> int:
    """Return the fewest clocks that last a time, given in so many units a second.

    Raises
    ------
    ValueError
        If the time is not over 0, or takes more than `most` clocks.
    """
    in_range(name, time, 1, most * units // clock)
    return -(-time * clock // units)
