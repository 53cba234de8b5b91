"""What is sent: lines good and bad, bytes, and what is no byte, in pieces that can be left out."""

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uart import FRAME, Levels, high, levels

__all__ = ["OPENING", "LineProtocol", "Input", "random_inputs"]


#: Pieces at the begin of each session.
OPENING = 3

#: Bytes of a session that is flooded in its middle at the latest.
LONG = 10_000

#: Answers that may be owed where lines need not wait for them.
MOST_OWED = 40

#: Part of the pieces that are sequences, where a machine has some.
SEQUENCES = 0.06


@dataclass(frozen=True)
class Input:
    """A piece of what is sent.

    Attributes
    ----------
    kind : str
        What it is.
    data : bytes
        The bytes that it is made of.
    levels : array of uint8
        The line, a level a clock.
    pressed : array of int, optional
        Switches that are pressed, a bit each, in each clock; none by default.
    """

    kind: str
    data: bytes
    levels: Levels
    pressed: NDArray[np.integer] | None = None

    def __str__(self) -> str:
        """Return what is sent."""
        pressed = "" if self.pressed is None else ", switches pressed"
        if not self.data:
            return f"{self.kind} of {len(self.levels)} clocks{pressed}"
        return (f"{self.kind} " if self.kind != "bytes" else "") + repr(self.data) + pressed


@dataclass(frozen=True)
class LineProtocol:
    """What lines of a machine look like.

    Attributes
    ----------
    legal : callable
        Gives a line by chance; most are legal, with their end.
    quiet : tuple of bytes
        Lines that change nothing, some of them legal.
    end : bytes
        What ends a line.
    letters : bytes
        Bytes with which a mutation makes another line out of one.
    longest : int
        Bytes of the longest line.
    room : int
        Bytes of lines that can wait; 0 if none have to, and no byte is lost.
    answer : int
        Bytes of line time in which an answer is out, at worst.
    begin : bytes
        What is sent at first.
    alive : bytes
        What is sent at last: all of it must be answered, and obeyed.
    spared : bytes
        Bytes that mutations and random bytes are without, as they do something whenever they come.
    sequence : callable, optional
        Gives, by chance and of the clocks of a bit, a piece that no line is: several lines, each
        with the time that it takes, and switches as it wants them meanwhile.
    """

    legal: Callable[[random.Random], bytes]
    quiet: tuple[bytes, ...]
    end: bytes
    letters: bytes
    longest: int
    room: int
    answer: int
    begin: bytes
    alive: bytes
    spared: bytes = b""
    sequence: "Callable[[random.Random, int], Input] | None" = None


def random_inputs(protocol: LineProtocol, seed: int, count: int, period: int) -> Iterator[Input]:
    """Give pieces with so many bytes, and what ends a session: the machine must still be there.

    As many lines wait as there is room for, and more only where the machine is flooded on purpose.
    Where no byte can be lost lines are sent as they come. Long sessions are flooded once or more.
    """
    rng = random.Random(seed)
    byte = FRAME * period
    yield Input("rest", b"", high(4 * byte))
    yield Input("bytes", protocol.begin, levels(protocol.begin, period))
    answers = (protocol.begin.count(protocol.end) + 2) * protocol.answer * byte
    yield Input("rest", b"", high(answers))
    owed = waiting = partial = 0  # clocks of answers; bytes that may wait; of a line without end
    flood_at = count // 2 if count >= LONG else -1
    while count > 0:
        item = (_flood if count <= flood_at else _random_input)(rng, protocol, period)
        if item.kind == "flood":
            flood_at = -1
        ends = item.data.count(protocol.end) + (item.kind == "noise")
        count -= max(1, len(item.data))
        if not protocol.room:
            yield item
            continue
        if item.kind == "flood":
            yield Input("rest", b"", high(owed + protocol.answer * byte))
            owed = waiting = partial = 0
        elif owed and waiting + partial + len(item.data) + 2 > protocol.room:
            yield Input("rest", b"", high(owed))
            owed = waiting = 0
        yield item
        if item.kind == "flood":
            continue
        waiting += len(item.data) + 1
        tail = item.data.rpartition(protocol.end)[2]
        partial = min(protocol.room, len(tail) + (0 if ends else partial))
        owed = max(0, owed + ends * protocol.answer * byte - len(item.levels))
        waiting = waiting if owed else 0
    end = protocol.end * 2
    if not protocol.room:
        owed = MOST_OWED * protocol.answer * byte
    yield Input("rest", b"", high(owed + 3 * byte))
    yield Input("bytes", end, levels(end, period))
    yield Input("rest", b"", high(4 * protocol.answer * byte))
    yield Input("alive", protocol.alive, levels(protocol.alive, period))
    answers = (protocol.alive.count(protocol.end) + 8) * protocol.answer * byte
    yield Input("rest", b"", high(answers))


def _random_input(rng: random.Random, protocol: LineProtocol, period: int) -> Input:
    if protocol.sequence is not None and rng.random() < SEQUENCES:
        return protocol.sequence(rng, period)
    kind = rng.choices(*zip(*_KINDS.items(), strict=True))[0]
    if kind is _flood:
        return _flood(rng, protocol, period)
    name, data, line = kind(rng, protocol, period)
    pause = rng.choice([0, 0, 0, 1, 3, period, 30 * period])
    return Input(name, data, np.concatenate([line, high(pause)]) if pause else line)


def _legal(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    data = protocol.legal(rng)
    return "bytes", data, levels(data, period)


def _mutated(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    line = bytearray(protocol.legal(rng))
    for _ in range(rng.choice([1, 1, 2, 3])):
        place = rng.randrange(len(line) + 1)
        line[place:place + rng.randrange(3)] = bytes(
            rng.choices([*protocol.letters, rng.randrange(256)], k=rng.randrange(3))
            ).translate(None, protocol.spared)
    return "bytes", bytes(line), levels(bytes(line), period)


def _any_bytes(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes,
                                                                                 Levels]:
    data = rng.randbytes(rng.choice([1, 3, 10, 40])).translate(None, protocol.spared)
    if rng.random() < 0.6:
        data += protocol.end
    return "bytes", data, levels(data, period)


def _long(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    """Put zeros, or anything, into a line, until it is about as long as may be."""
    line, zeros = protocol.legal(rng), protocol.longest + rng.randrange(-12, 6)
    place = next((n for n, byte in enumerate(line) if byte in b"0123456789"), len(line) - 1)
    data = line[:place] + rng.choice([b"0", b"0", b" ", b"A"]) * (zeros - len(line)) + line[place:]
    return "bytes", data, levels(data, period)


def _framing(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    """Leave stop bits out."""
    data = protocol.legal(rng)
    line = levels(data, period).reshape(-1, FRAME, period)
    line[rng.sample(range(len(data)), rng.randint(1, min(2, len(data)))), -1] = 0
    return "without a stop bit", data, np.concatenate([line.reshape(-1), high(4)])


def _glitched(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    """Disturb a line for moments of a sixteenth of a bit, far enough from each other."""
    data = protocol.legal(rng)
    line = np.concatenate([high(period), levels(data, period), high(period)])
    width = period // 16
    for place in range(rng.randrange(period), len(line) - width, 4 * period):
        line[place:place + width] ^= 1
    return "with glitches", data, line


def _break(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    clocks = rng.choice([1, 2, 5, FRAME - 1, FRAME, FRAME + 1, 12, 30]) * period
    return "break", b"", np.concatenate([
        _obeyed(period), np.zeros(clocks, np.uint8), high(rng.randrange(40))])


def _broken(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    """Begin a break in the middle of a byte, or what is nearly long enough for one."""
    data = protocol.legal(rng)
    line, byte = levels(data, period), FRAME * period
    begin = rng.randrange(len(line))
    end = (begin // byte + 1) * byte
    # What counts is behind the last look at the missing stop bit.
    long_enough = end - begin - period // 2 + period // 16 + 1 + byte
    clocks = long_enough + rng.choice([rng.randint(-byte, 0), -2, -1, 0, 1, 2, period, 20 * period])
    low = np.zeros(clocks, np.uint8)
    if rng.random() < 0.5:  # a disturbance, or a little more
        low[rng.randrange(clocks):][:rng.randint(1, 4 * period // 16)] = 1
    return "break", data, np.concatenate([
        _obeyed(period), line[:begin], low, high(rng.choice([3, period, 40])), line[end:]])


def _noise(rng: random.Random, protocol: LineProtocol, period: int) -> tuple[str, bytes, Levels]:
    runs = [rng.randint(1, rng.choice([2, 20, 60])) for _ in range(rng.randrange(2, 60))]
    line = (np.arange(len(runs)) & 1).repeat(runs).astype(np.uint8)
    return "noise", b"", np.concatenate([_obeyed(period), line, high(12 * period)])


def _obeyed(period: int) -> Levels:
    """Wait until a line before is obeyed, be it ever so long, so that a break comes behind it."""
    return high(2 * FRAME * period)


def _flood(rng: random.Random, protocol: LineProtocol, period: int) -> Input:
    """Send more lines than can be answered.

    Where bytes are lost, none of them changes anything, and they go by before anything else comes.
    """
    short = [line for line in protocol.quiet if len(line) <= 5]  # more of them wait
    lines = rng.choices(rng.choice([protocol.quiet, short]), k=max(80, 2 * protocol.room))
    if not protocol.room:
        data = b"".join(line + rng.choice([protocol.end, protocol.legal(rng)]) * rng.choice([0, 1,
                                                                                             3])
                        for line in lines)
        return Input("flood", data, levels(data, period))
    data = protocol.end + b"".join(lines)
    drained = protocol.room * protocol.answer * FRAME * period
    end = levels(protocol.end, period)
    return Input("flood", data, np.concatenate([
        end, high(2 * protocol.answer * FRAME * period), levels(data, period), high(drained), end,
        high(3 * protocol.answer * FRAME * period)]))


_KINDS = {_legal: 100, _mutated: 80, _any_bytes: 60, _long: 3, _framing: 10, _glitched: 20,
          _break: 10, _broken: 15, _noise: 10, _flood: 0.6}
