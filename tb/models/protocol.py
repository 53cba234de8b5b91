"""What a serial line carries, in plain Python."""

__all__ = ["bits"]


def bits(byte: int, *, stop: int = 1) -> list[int]:
    """Return the ten bits of a byte on a line, 8N1, in the order in which they are sent."""
    return [0, *(byte >> n & 1 for n in range(8)), stop]
