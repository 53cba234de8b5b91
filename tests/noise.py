"""A line that drops, doubles, changes and invents bytes."""

import random

__all__ = ["Noise"]


class Noise:
    """One way of a bad line.

    Parameters
    ----------
    rng : random.Random
        Chance.
    rate : float
        Faults for each byte.

    Attributes
    ----------
    faults : int
        So far.
    """

    def __init__(self, rng: random.Random, rate: float) -> None:
        self._rng, self._rate = rng, rate
        self.faults = 0

    def through(self, data: bytes) -> bytes:
        """Return what comes out at the other end."""
        received = bytearray()
        for byte in data:
            if self._rng.random() >= self._rate:
                received.append(byte)
                continue
            self.faults += 1
            match self._rng.randrange(5):
                case 0:  # dropped
                    pass
                case 1:  # doubled
                    received += bytes([byte, byte])
                case 2:  # a bit changed
                    received.append(byte ^ 1 << self._rng.randrange(8))
                case 3:  # another one
                    received.append(self._rng.choice(b"0123456789ABCDEF:=\r\n\0"))
                case 4:  # one more
                    received += bytes([byte, self._rng.randrange(256)])
        return bytes(received)
