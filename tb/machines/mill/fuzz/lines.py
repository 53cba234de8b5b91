"""Lines with orders for the mill: which are right, and random ones."""

import random
import re
import zlib
from collections.abc import Iterator

from tb.fuzz.frames import Frame
from tb.fuzz.frames import frames as split
from tb.fuzz.inputs import LineProtocol
from tb.uart import DecodedByte

__all__ = ["DOWN", "ENDS", "GO", "LONGEST", "NUMBERS", "OPEN", "PROTOCOL", "ROOM", "QUERY", "UP",
           "decode_request", "frames", "request", "with_crc"]

SIDE = 400
"""Places to go to are the corners of a square: so each move is along one of the 8 directions. They
are so far from each other that orders have to wait."""

LONGEST, ROOM, NUMBERS = 32, 63, 1 << 24
ENDS = b"\r\n"
QUERY, OPEN, GO, UP, DOWN = range(5)


def frames(received: Iterator[DecodedByte]) -> Iterator[Frame]:
    """Give the frames among bytes."""
    return split(received, ENDS, LONGEST)


def with_crc(digits: str) -> bytes:
    """Append the CRC to digits."""
    crc = zlib.crc32(bytes.fromhex(digits[::-1])[::-1])
    return (digits + f"{crc:08X}"[::-1]).encode()


def request(kind: int, session: int = 0, number: int = 0, x: int = 0, y: int = 0) -> bytes:
    """Give a line."""
    return b":%s\r" % with_crc(f"{kind:02X}{session:08X}{number % NUMBERS:06X}{x:04X}{y:04X}")


def decode_request(frame: Frame) -> tuple[int, ...] | None:
    """Read a request; None if its line is not right."""
    text = frame.text.decode("latin-1")
    if frame.wrong or not re.fullmatch("[0-9A-F]{32}", text) or with_crc(text[:24]) != frame.text:
        return None
    return tuple(int(text[a:b], 16) for a, b in [(0, 2), (2, 10), (10, 16), (16, 20), (20, 24)])


_GAP = b" " * 36
"""Time for an answer more."""


def _job(rng: random.Random) -> bytes:
    """Give a session and its first orders, or other requests."""
    if rng.random() < 0.3:
        kind = rng.choice([QUERY, OPEN, GO, UP, DOWN, DOWN + 1, 0xFF])
        return request(kind, rng.choice([0, 1, rng.getrandbits(32)]) if kind != OPEN else 0,
                       rng.choice([0, 1, NUMBERS - 1]), 0, 0)
    session, number = rng.getrandbits(32), rng.choice([0, 7, NUMBERS - 2])
    lines = [request(OPEN), request(OPEN, session, number)]
    for _ in range(rng.randint(1, 5)):
        number += 1
        corner = rng.choice([0, SIDE]), rng.choice([0, SIDE])
        order = request(rng.choice([GO, GO, GO, UP, DOWN]), session, number, *corner)
        lines += [order] * rng.choice([1, 1, 2])
    return b"".join(line + _GAP for line in lines)


PROTOCOL = LineProtocol(
    _job, quiet=(request(QUERY), request(QUERY), request(QUERY)[:-3] + b"\r", b":\r", b"AB\n",
                 b":"),
    end=b"\r", letters=b":\r\n0123456789ABCDEF=", longest=LONGEST, room=ROOM, answer=40,
    begin=request(QUERY),
    alive=b"".join(line + _GAP * 9 for line in [
        request(OPEN), request(OPEN), request(OPEN, 5), request(GO, 5, 1, 0, SIDE),
        request(GO, 5, 2, SIDE, SIDE), request(DOWN, 5, 3), request(UP, 5, 4), request(QUERY)]))
"""Its line, for random inputs."""
