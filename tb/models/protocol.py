"""Models of the serial protocol: UART receiver and line buffer."""

from collections import deque

__all__ = ["DAMAGED", "GOOD", "LONG", "LineModel", "ReceiverModel", "bits"]

GOOD, LONG, DAMAGED = 0x100, 0x101, 0x102
"""Ends of lines, as items of a line."""


def bits(byte: int, *, stop: int = 1) -> list[int]:
    """Return the ten bits of a byte, 8N1, in the order of sending."""
    return [0, *(byte >> n & 1 for n in range(8)), stop]


class ReceiverModel:
    """A receiver: samples each bit three times, counted from the edge of the start bit, and votes.

    Attributes
    ----------
    byte : tuple of int and bool, optional
        The received byte, and whether it has a framing error; None if there is none.
    line_break : bool
        Whether the line is at a break.
    framing, overrun : bool
        Whether a stop bit was missing, or a byte was lost, in the last clock.
    """

    def __init__(self, *, period: int) -> None:
        self.period, self.spread = period, period // 16
        self.reset()

    def reset(self) -> None:
        """Reset; the line must be high for a while first."""
        self.levels: list[int] = []  # samples since the start bit began
        self.high: int | None = 0  # clocks for which it is high, or None when that was long enough
        self.byte: tuple[int, bool] | None = None
        self.lost = False
        self.low = 0  # clocks for which it was low instead of a stop bit
        self.line_break = self.framing = self.overrun = False

    def clock(self, rx: int, taken: bool) -> None:
        """Advance one clock, in which the received byte was taken or not."""
        found = self._sample(rx)
        self.framing = found is not None and found[1]
        self.overrun = found is not None and self.byte is not None and not taken
        if self.byte and not taken:
            self.lost |= self.overrun
        elif found:
            self.byte, self.lost = (found[0], found[1] or self.lost), False
        else:
            self.byte = None

    def _sample(self, rx: int) -> tuple[int, bool] | None:
        """Sample the line; return a complete byte, and whether its stop bit is missing."""
        if self.high is not None:
            self.high = self.high + 1 if rx else 0
            self.low += not rx
            self.line_break |= self.low >= 10 * self.period
            if self.high > 2 * self.spread:
                self.high, self.low, self.line_break = None, 0, False
            return None
        if self.levels or not rx:
            self.levels.append(rx)
        if len(self.levels) == 1 + self._last(0) and self._vote(0):
            self.levels = []
        if len(self.levels) <= self._last(9):
            return None
        byte, stop = sum(self._vote(n + 1) << n for n in range(8)), self._vote(9)
        self.levels, self.high = [], None if stop else 0
        self.line_break = not (byte or stop)
        return byte, not stop

    def _last(self, bit: int) -> int:
        return bit * self.period + self.period // 2 + self.spread

    def _vote(self, bit: int) -> int:
        return int(sum(self.levels[self._last(bit) - n * self.spread] for n in range(3)) >= 2)


class LineModel:
    """A line buffer: bytes and ends, in the order of reading."""

    def __init__(self, *, length: int, depth: int, end: int) -> None:
        self.length, self.depth, self.end = length, depth, end
        self.reset()

    def reset(self) -> None:
        """Clear all lines."""
        self.line: list[int] = []
        self.verdict = GOOD
        self.waiting: deque[int] = deque()
        self.fetching = 0  # clocks for which the next item waits

    @property
    def room(self) -> bool:
        """Whether a byte can be taken."""
        return len(self.waiting) + len(self.line) < self.depth - 1

    @property
    def head(self) -> int | None:
        """The next item, if it is offered already."""
        return self.waiting[0] if self.fetching >= 2 else None

    def clock(self, byte: tuple[int, bool] | None, taken: bool) -> None:
        """Advance one clock: a byte comes if there is room, and the head was taken or not."""
        room = self.room
        self.fetching = self.fetching + 1 if self.waiting else 0
        if taken:
            self.waiting.popleft()
            self.fetching = 0
        if byte and room:
            self._read(*byte)

    def _read(self, byte: int, error: bool) -> None:
        if error:
            self.verdict = DAMAGED
        elif byte != self.end and len(self.line) == self.length and self.verdict == GOOD:
            self.verdict = LONG
        if self.verdict != GOOD:
            self.line = []
        if byte == self.end:
            if self.line[-1:] == [13]:  # a CR before the end is not part of the line
                self.line.pop()
            self.waiting += [*self.line, self.verdict]
            self.line, self.verdict = [], GOOD
        elif self.verdict == GOOD:
            self.line.append(byte)
