"""The clock that machines have unless they are given another."""

__all__ = ["CLOCK"]

CLOCK = 50_000_000
"""In Hz: that of the thesis's board."""
