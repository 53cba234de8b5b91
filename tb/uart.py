"""A serial line at the pins of a design: bytes in and out, while the engine runs by the thousand.

The line changes only where bits do. So the engine is asked to run from one change to the next, and
what comes back is read from the times at which the output changed.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from itertools import groupby

from numpy.typing import NDArray

from .engines import Engine
from .models.protocol import bits

__all__ = ["Listener", "SerialLine", "shown", "typed"]

#: Bits of a byte on the line, 8N1: start, eight, stop.
FRAME = 10


def typed(text: bytes, bit: int) -> list[int]:
    """Return the levels of a line on which `text` is sent, `bit` clocks a bit."""
    return [level for byte in text for each in bits(byte) for level in [each] * bit]


def shown(line: Sequence[int] | NDArray, bit: int) -> bytes:
    """Read what is sent on an undisturbed line; a byte that is cut off at its end is left out."""
    found, clock = bytearray(), 0
    while clock + 9 * bit + bit // 2 < len(line):
        if line[clock]:
            clock += 1
            continue
        middles = [line[clock + place * bit + bit // 2] for place in range(10)]
        assert (middles[0], middles[9]) == (0, 1), f"no byte at clock {clock}"
        found.append(sum(int(level) << place for place, level in enumerate(middles[1:9])))
        clock += 9 * bit + bit // 2
    return bytes(found)


class Listener:
    """Reads bytes, 8N1, from the times at which a line changes. It is high at first.

    Parameters
    ----------
    period : int
        Clocks of a bit.

    Attributes
    ----------
    errors : int
        Bytes that had no stop bit. They are left out.
    """

    def __init__(self, period: int) -> None:
        self._period = period
        self._level = 1
        self._began: int | None = None
        self._bits: list[int] = []
        self.errors = 0

    def hear(self, clock: int, level: int) -> bytes:
        """Note what the line is from a clock on; give the byte that is complete by then, if any.

        The same level as before only says that time has passed.
        """
        heard = b"".join(self._until(clock))
        if self._began is None and self._level and not level:
            self._began = clock
        self._level = level
        return heard

    def _until(self, clock: int) -> Iterator[bytes]:
        """Look into the middle of each bit before a clock."""
        while self._began is not None:
            if self._began + len(self._bits) * self._period + self._period // 2 >= clock:
                return
            self._bits.append(self._level)
            if len(self._bits) == FRAME:
                start, *word, stop = self._bits
                self._began, self._bits = None, []
                if stop and not start:
                    yield bytes([sum(bit << n for n, bit in enumerate(word))])
                else:
                    self.errors += 1


class SerialLine:
    """A serial line to a design that runs. It is high for a byte's time before anything is sent.

    Parameters
    ----------
    engine : Engine
        The design.
    period : int
        Clocks of a bit.
    rx, tx : str
        Its input and its output, as it calls them.
    """

    def __init__(self, engine: Engine, period: int, *, rx: str = "rx", tx: str = "tx") -> None:
        self._engine, self._period, self._rx, self._tx = engine, period, rx, tx
        self._waiting: deque[int] = deque()
        # Of the byte under way, and for how long. First it rests, so that the first byte is seen.
        self._levels = deque([(1, FRAME * period)])
        self._listener = Listener(period)
        engine.set(**{rx: 1})

    @property
    def waiting(self) -> int:
        """Bytes that have not begun."""
        return len(self._waiting)

    @property
    def errors(self) -> int:
        """Bytes from the design that had no stop bit."""
        return self._listener.errors

    def send(self, data: bytes) -> None:
        """Send bytes, when those before are sent."""
        self._waiting.extend(data)

    def send_break(self) -> None:
        """Hold the line low for two bytes' time, at once; what waits comes behind that.

        A byte that is under way is cut off.
        """
        self._levels = deque([(0, 2 * FRAME * self._period), (1, FRAME * self._period)])

    def run(self, clocks: int) -> bytes:
        """Run so many clocks; give the bytes that the design has sent meanwhile.

        A byte is there with the middle of its stop bit.
        """
        engine, heard = self._engine, []
        end = engine.clock + clocks
        while engine.clock < end:
            level, left = self._next_level(end - engine.clock)
            engine.set(**{self._rx: level})
            span = min(left, end - engine.clock)
            changes = engine.run(span, [self._tx])
            for clock, seen in zip(changes.clock, changes[self._tx], strict=True):
                heard.append(self._listener.hear(int(clock), int(seen)))
            if self._levels:
                self._levels[0] = level, left - span
        heard.append(self._listener.hear(end, engine.get(self._tx)))
        return b"".join(heard)

    def _next_level(self, idle: int) -> tuple[int, int]:
        """Give the level of the line now, and for how many clocks; `idle` if nothing waits."""
        while self._levels and not self._levels[0][1]:
            self._levels.popleft()
        if not self._levels and self._waiting:
            for level, run in groupby(bits(self._waiting.popleft())):
                self._levels.append((level, self._period * len(list(run))))
        return self._levels[0] if self._levels else (1, idle)
