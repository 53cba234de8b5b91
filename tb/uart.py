"""Serial lines, 8N1: bytes to levels, and levels or change times to bytes.

A line changes only at bit boundaries. So an engine runs from one change to the next, and what it
sends is decoded from the times of the changes.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Iterator
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .engines import Engine
from .models.protocol import bits

__all__ = ["FRAME", "BitTimingError", "DecodedByte", "Decoder", "Levels", "SerialLine", "Text",
           "decode", "decode_output", "encode", "high", "levels"]

Levels = NDArray[np.uint8]

#: Bits of a character on the line: start, eight data bits, stop.
FRAME = 10

_WORDS = np.array([bits(byte) for byte in range(256)], np.uint8)
#: Majority of three samples of each bit: index is ten bits of levels, value their majority.
_FRAMES = {int.from_bytes(bytes(word >> n & 1 for n in range(FRAME)), "little"): word
           for word in range(1 << FRAME)}


class BitTimingError(Exception):
    """A level of an output that does not last for whole bits of a character.

    Attributes
    ----------
    clock : int
        Start of that byte.
    """

    def __init__(self, clock: int) -> None:
        super().__init__("the output is not 8N1: a bit has a wrong length")
        self.clock = clock


class DecodedByte(NamedTuple):
    """A byte received.

    Attributes
    ----------
    clock : int
        The clock in which it is complete.
    byte : int
        Its value.
    error : bool
        Framing error: its stop bit is low.
    broken : int
        The clock from which the line, low since this byte, is a break; -1 if it is not.
    """

    clock: int
    byte: int
    error: bool
    broken: int = -1


class Text:
    """Bytes of an output.

    Attributes
    ----------
    text : bytes
        All bytes.
    starts : list of int
        The clock in which each byte begins.
    """

    def __init__(self, text: bytes, starts: list[int]) -> None:
        self.text, self.starts = text, starts

    def before(self, clock: int) -> int:
        """Return the number of bytes that begin before a clock."""
        return bisect_left(self.starts, clock)


def levels(data: bytes, period: int) -> Levels:
    """Encode bytes without gaps between them, `period` clocks per bit."""
    return _WORDS[np.frombuffer(data, np.uint8)].reshape(-1).repeat(period)


def encode(data: bytes, period: int) -> list[int]:
    """Encode bytes as :func:`levels`, as a list."""
    return levels(data, period).tolist()


def high(clocks: int) -> Levels:
    """Return an idle line."""
    return np.ones(clocks, np.uint8)


def decode(line: Levels, period: int) -> Iterator[DecodedByte]:
    """Decode levels like a receiver with majority voting.

    It samples each bit three times around its middle, counted from the edge of the start bit, a
    sixteenth of a bit apart, and takes the majority. A start bit that is high is dropped. After a
    framing error, and at first, the line must have been high for longer than a disturbance. Until
    then it is a break at once if that byte is 0, and otherwise when it has been low for the time of
    one more byte.
    """
    row, spread = line.tobytes(), period // 16
    middle, idle = period // 2, b"\1" * (2 * spread + 1)

    def settled(clock: int) -> int:
        found = row.find(idle, clock)
        return found + len(idle) if found >= 0 else len(row)

    def broken(begin: int, end: int) -> int:
        low = row.count(b"\0", begin, end) >= FRAME * period
        return begin + int(np.flatnonzero(line[begin:end] == 0)[FRAME * period - 1]) if low else -1

    clock = settled(0)
    while (start := row.find(b"\0", clock)) >= 0:
        decided = start + middle + spread
        end = decided + 9 * period
        if end >= len(row):
            return
        a, b, c = (int.from_bytes(row[start + middle + offset:end + 1:period], "little")
                   for offset in (-spread, 0, spread))
        word = _FRAMES[a & b | a & c | b & c]
        if word & 1:
            clock = decided + 1
            continue
        byte, clock = word >> 1 & 0xFF, end + 1
        if word >> 9:
            yield DecodedByte(end, byte, False)
            continue
        clock = settled(end + 1)
        yield DecodedByte(end, byte, True, broken(end + 1, clock) if byte else end)


def decode_output(line: ArrayLike, period: int) -> Text:
    """Decode an output, each bit of which must last exactly `period` clocks.

    An incomplete byte at the end is left out.

    Raises
    ------
    BitTimingError
        If there is anything else on the line.
    """
    row = np.asarray(line, np.uint8).tobytes()
    text, starts, clock = bytearray(), [], 0
    while (start := row.find(b"\0", clock)) >= 0 and start + FRAME * period <= len(row):
        clock = start + FRAME * period
        word = _FRAMES[int.from_bytes(row[start + period // 2:clock:period], "little")]
        byte = bytes([word >> 1 & 0xFF])
        if row[start:clock] != levels(byte, period).tobytes():
            raise BitTimingError(start)
        text += byte
        starts.append(start)
    return Text(bytes(text), starts)


class Decoder:
    """Decoder of the times at which a line changes, with a sample in the middle of each bit.

    The line is high at first.

    Parameters
    ----------
    period : int
        Clocks per bit.

    Attributes
    ----------
    errors : int
        Framing errors so far. Bytes with one are left out.
    """

    def __init__(self, period: int) -> None:
        self._period = period
        self._level = 1
        self._start: int | None = None
        self._bits: list[int] = []
        self.errors = 0

    def feed(self, clock: int, level: int) -> bytes:
        """Set the level of the line from a clock on; return the bytes completed before it.

        A level equal to the last only advances the time.
        """
        received = b"".join(self._until(clock))
        if self._start is None and self._level and not level:
            self._start = clock
        self._level = level
        return received

    def _until(self, clock: int) -> Iterator[bytes]:
        """Sample each bit whose middle is before a clock."""
        while self._start is not None:
            if self._start + len(self._bits) * self._period + self._period // 2 >= clock:
                return
            self._bits.append(self._level)
            if len(self._bits) == FRAME:
                start, *word, stop = self._bits
                self._start, self._bits = None, []
                if stop and not start:
                    yield bytes([sum(bit << n for n, bit in enumerate(word))])
                else:
                    self.errors += 1


class SerialLine:
    """A serial line to a running design. It is high for a byte's time at the start.

    Parameters
    ----------
    engine : Engine
        The design.
    period : int
        Clocks per bit.
    rx, tx : str
        Names of its input and its output.
    """

    def __init__(self, engine: Engine, period: int, *, rx: str = "rx", tx: str = "tx") -> None:
        self._engine, self._period, self._rx, self._tx = engine, period, rx, tx
        self._waiting: deque[int] = deque()
        # Level of the byte under way, and its remaining clocks. The line is idle first.
        self._levels = deque([(1, FRAME * period)])
        self._decoder = Decoder(period)
        engine.set(**{rx: 1})

    @property
    def waiting(self) -> int:
        """Queued bytes that have not begun."""
        return len(self._waiting)

    @property
    def errors(self) -> int:
        """Framing errors in the output of the design."""
        return self._decoder.errors

    def send(self, data: bytes) -> None:
        """Queue bytes."""
        self._waiting.extend(data)

    def send_break(self) -> None:
        """Hold the line low for two bytes' time, now; queued bytes follow.

        A byte that is under way is cut off.
        """
        self._levels = deque([(0, 2 * FRAME * self._period), (1, FRAME * self._period)])

    def run(self, clocks: int) -> bytes:
        """Run a number of clocks; return the bytes that the design has sent meanwhile.

        A byte is complete with the middle of its stop bit.
        """
        engine, received = self._engine, []
        end = engine.clock + clocks
        while engine.clock < end:
            level, left = self._next_level(end - engine.clock)
            engine.set(**{self._rx: level})
            span = min(left, end - engine.clock)
            changes = engine.run(span, [self._tx])
            for clock, seen in zip(changes.clock, changes[self._tx], strict=True):
                received.append(self._decoder.feed(int(clock), int(seen)))
            if self._levels:
                self._levels[0] = level, left - span
        received.append(self._decoder.feed(end, engine.get(self._tx)))
        return b"".join(received)

    def _next_level(self, idle: int) -> tuple[int, int]:
        """Return the level of the line now and its remaining clocks; `idle` if none are queued."""
        while self._levels and not self._levels[0][1]:
            self._levels.popleft()
        if not self._levels and self._waiting:
            for level, run in groupby(bits(self._waiting.popleft())):
                self._levels.append((level, self._period * len(list(run))))
        return self._levels[0] if self._levels else (1, idle)
