"""Frames of `single`: which are legal, what is wrong with others, and some by chance."""

import random
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .inputs import LineProtocol
from .line import DecodedByte

__all__ = ["ASKS", "PROTOCOL", "ENDS", "GREETING", "HELP", "LEGAL", "ROOM", "SPEEDS", "Frame",
           "begin", "frames", "refusal", "word"]

POSITIONS, SPEEDS, LONGEST = 10_000, 60_000, 126
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


class Frame(NamedTuple):
    """A frame that has ended: when, what is in it, and what is wrong with the bytes themselves."""

    clock: int
    text: bytes
    wrong: str


def frames(decoded: Iterator[DecodedByte], ends: bytes = ENDS, longest: int = LONGEST
           ) -> Iterator[Frame]:
    """Give the frames among bytes: from ``:`` to one of `ends`, begun anew at each ``:``.

    A byte outside that lacks its stop bit may have been a ``:``, and begins a damaged one.
    """
    text: bytearray | None = None
    damaged = False
    for clock, byte, error, _ in decoded:
        if byte == ord(":"):
            text, damaged = bytearray(), error
        elif text is not None or error:
            text = bytearray() if text is None else text
            damaged |= error
            if byte in ends:
                wrong = "command" if damaged else "length" if len(text) > longest else ""
                yield Frame(clock, bytes(text), wrong)
                text = None
            else:
                text.append(byte)


def refusal(text: bytes) -> str:
    """Say what is wrong with the text of a frame, or nothing."""
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
    """Give what a text begins with, in capitals."""
    found = _WORD.match(text)
    return found[0].upper() if found else b""


def begin(rates: Sequence[int]) -> bytes:
    """Give the frames that set a speed and begin a long way."""
    return b":v%d\r:x9999\r" % tuple(rates)


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
    begin=b":v30000\r", alive=b":e1\r:v59999\r:x0\r:x7\r:x?\r:v?\r")
"""How one speaks to it."""
