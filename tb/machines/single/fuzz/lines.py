"""Frames of `single`: which are legal, what is wrong with others, and random ones."""

import random
import re
from collections.abc import Iterator, Sequence

from tb.fuzz.frames import Frame
from tb.fuzz.frames import frames as split
from tb.fuzz.inputs import LineProtocol
from tb.uart import DecodedByte

__all__ = ["ASKS", "ENDS", "GREETING", "HELP", "LEGAL", "PROTOCOL", "ROOM", "SPEEDS",
           "START_SPEED", "begin", "frames", "refusal", "word"]

POSITIONS, SPEEDS, START_SPEED, LONGEST = 10_000, 60_000, 100, 126
ROOM = 127
"""Bytes and ends of frames that can wait."""

ENDS = b"\r"
"""Bytes that end a frame."""

GREETING, HELP = b"!\r\n", b"?\r\n"
"""Short ones, so that there is time for more."""

_WORD = re.compile(rb"[^ 0-9+-]*")
ASKS = {b"X?": rb"x:(\d+)\r\nok\r\n", b"V?": rb"v:(\d+)\r\nok\r\n",
        b"D": re.escape(HELP + b"ok\r\n")}
"""Words that take no number, and what they are answered, as patterns."""

LEGAL = {b"X": range(POSITIONS), b"V": range(1, SPEEDS), b"E": range(2)}
"""Words that take a number, and which."""


def frames(received: Iterator[DecodedByte]) -> Iterator[Frame]:
    """Return the frames among bytes."""
    return split(received, ENDS, LONGEST)


def refusal(text: bytes) -> str:
    """Return what is wrong with the text of a frame, or nothing."""
    own = word(text)
    rest = text[len(own):]
    if own in ASKS:
        return "command" if rest else ""
    if own not in LEGAL:
        return "command"
    if not re.fullmatch(rb"[0-9]+", rest):
        return "number"
    return "" if int(rest) in LEGAL[own] else "range"


def word(text: bytes) -> bytes:
    """Return what a text begins with, in capitals."""
    found = _WORD.match(text)
    return found[0].upper() if found else b""


def begin(rates: Sequence[int]) -> bytes:
    """Return the frames that set a speed and begin a long way."""
    return b":v%d\r:x%d\r" % (*rates, POSITIONS - 1)


def _legal(rng: random.Random) -> bytes:
    kind = rng.randrange(20)
    if kind < 8:
        number = rng.randrange(rng.choice([3, 20, 200, POSITIONS, POSITIONS + 3]))
        line = b":x%d\r" % number
    elif kind < 11:
        line = b":v%d\r" % rng.choice([rng.randrange(SPEEDS), rng.randrange(20_000, SPEEDS + 9)])
    else:
        line = rng.choice([b":x?\r", b":x?\r", b":v?\r", b":d\r", b":e0\r", b":e1\r", b":e1\r",
                           b":e2\r", b":\r"])
    return line.upper() if rng.random() < 0.2 else line


PROTOCOL = LineProtocol(
    _legal, quiet=(b":x?\r", b":v?\r", b":d\r", b":e2\r", b":x-1\r", b":zz\r", b"\r", b"ab", b":"),
    end=b"\r", letters=b":\r?0129xvedXVED +-", longest=LONGEST, room=ROOM, answer=15,
    begin=b":v30000\r", alive=b":e1\r:v%d\r:x0\r:x7\r:x?\r:v?\r" % (SPEEDS - 1))
"""Its line, for random inputs."""
