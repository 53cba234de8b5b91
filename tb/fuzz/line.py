"""A serial line, 8N1, as an array of levels: bytes put on it, and what is heard of any levels."""

from bisect import bisect_left
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["CUT", "FRAME", "BitTimingError", "DecodedByte", "Text", "high", "decode", "levels",
           "decode_output"]

Levels = NDArray[np.uint8]

#: A clock that is never reached.
CUT = 1 << 60

#: Bits of a byte on the line: start, eight, stop.
FRAME = 10

_WORDS = (np.arange(256)[:, None] << 1 | 0x200) >> np.arange(FRAME) & 1
#: What two of three looks at each bit say: levels as a number of ten bytes, and the bits of that.
_LOOKS = {int.from_bytes(bytes(word >> n & 1 for n in range(FRAME)), "little"): word
          for word in range(1 << FRAME)}


class BitTimingError(Exception):
    """What a machine sends is no byte.

    Attributes
    ----------
    clock : int
        Where.
    """

    def __init__(self, clock: int) -> None:
        super().__init__("what is sent is no byte: a bit is not as long as it should be")
        self.clock = clock


class DecodedByte(NamedTuple):
    """A byte that came in.

    Attributes
    ----------
    clock : int
        With which it is complete.
    byte : int
        What it is.
    error : bool
        It lacks its stop bit.
    broken : int
        The clock with which the line, low from this byte on, is a break; -1 if it is none.
    """

    clock: int
    byte: int
    error: bool
    broken: int = -1


class Text:
    """What a machine has said.

    Attributes
    ----------
    text : bytes
        All of it.
    starts : list of int
        The clock in which each byte begins.
    """

    def __init__(self, text: bytes, starts: list[int]) -> None:
        self.text, self.starts = text, starts

    def before(self, clock: int) -> int:
        """Count the bytes that begin before a clock."""
        return bisect_left(self.starts, clock)


def levels(data: bytes, period: int) -> Levels:
    """Put bytes on a line, `period` clocks a bit."""
    bits = _WORDS[np.frombuffer(data, np.uint8)].reshape(-1)
    return bits.repeat(period).astype(np.uint8)


def high(clocks: int) -> Levels:
    """Leave the line alone."""
    return np.ones(clocks, np.uint8)


def decode(line: Levels, period: int) -> Iterator[DecodedByte]:
    """Give the bytes that a receiver hears, of any levels.

    It looks three times into the middle of each bit, counted from the edge of the start bit, a
    sixteenth of a bit apart, and two looks decide. A start that is none is dropped. After a byte
    without a stop bit, and at first, the line must have been high for longer than a disturbance.
    Until then it is a break at once if that byte is 0, and else when it has been low for the time
    of a byte more.
    """
    row, spread = line.tobytes(), period // 16
    middle, rest = period // 2, b"\1" * (2 * spread + 1)

    def settled(clock: int) -> int:
        found = row.find(rest, clock)
        return found + len(rest) if found >= 0 else len(row)

    def broken(begin: int, end: int) -> int:
        low = row.count(b"\0", begin, end) >= FRAME * period
        return begin + int(np.flatnonzero(line[begin:end] == 0)[FRAME * period - 1]) if low else -1

    clock = settled(0)
    while (start := row.find(b"\0", clock)) >= 0:
        decided = start + middle + spread
        end = decided + 9 * period
        if end >= len(row):
            return
        a, b, c = (int.from_bytes(row[start + middle + look:end + 1:period], "little")
                   for look in (-spread, 0, spread))
        word = _LOOKS[a & b | a & c | b & c]
        if word & 1:
            clock = decided + 1
            continue
        byte, clock = word >> 1 & 0xFF, end + 1
        if word >> 9:
            yield DecodedByte(end, byte, False)
            continue
        clock = settled(end + 1)
        yield DecodedByte(end, byte, True, broken(end + 1, clock) if byte else end)


def decode_output(line: Levels, period: int) -> Text:
    """Read what a machine says, each bit of which must be as long as it should be.

    A byte that is cut off at the end is left out.

    Raises
    ------
    Broken
        If there is anything else on the line.
    """
    row, text, starts, clock = line.tobytes(), bytearray(), [], 0
    while (start := row.find(b"\0", clock)) >= 0 and start + FRAME * period <= len(row):
        byte = row[start:start + FRAME * period]
        value = _BYTES.get(middle := int.from_bytes(byte[period // 2::period], "little"))
        if value is None or byte != _repeated(middle, period):
            raise BitTimingError(start)
        text.append(value)
        starts.append(start)
        clock = start + FRAME * period
    return Text(bytes(text), starts)


_BYTES = {key: word >> 1 & 0xFF for key, word in _LOOKS.items() if not word & 1 and word >> 9}


def _repeated(middles: int, period: int) -> bytes:
    return b"".join(bytes([level]) * period for level in middles.to_bytes(FRAME, "little"))
