"""Lines of `positioner`: which are legal, what is wrong with others, and some by chance."""

import random
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from tb.fuzz.inputs import LineProtocol
from tb.uart import DecodedByte

__all__ = ["AXES", "BREAK", "PROTOCOL", "DOWN", "START_SPEED", "TOP_SPEED", "UP", "Line", "begin",
           "refusal", "split_lines"]

AXES, POINTS, LONGEST, TOP_SPEED, START_SPEED = 3, 7, 254, 1500, 200
UP, DOWN = 2**31 - 1, -2**31
_SYNTAX = {b"CONNECT": "", b"DISCONNECT": "", b"MOV": "mw", b"STOP": "m", b"VEL": "mr",
           b"P": "pnnn", b"GOTO": "p", b"ORIGIN": "", b"POS": "nnn", b"ACK": "f", b"STATE": ""}
_KINDS = {"m": rb"MOT[123]", "w": rb"CC?", **dict.fromkeys("rpnf", rb"[-+]?\d+")}
_RANGES = {"r": (1, TOP_SPEED), "p": (1, POINTS), "n": (DOWN, 2**32 - 1), "f": (0, 1)}


class Line(NamedTuple):
    """A line that has ended: when, what is in it, and what is wrong with the bytes themselves."""

    clock: int
    text: bytes
    wrong: str


BREAK = "BREAK"
"""What is wrong with a line that is none: there is a break, in the middle of another."""


def split_lines(decoded: Iterator[DecodedByte]) -> Iterator[Line]:
    """Yield the lines among bytes, and the breaks."""
    text, damaged = bytearray(), False
    for clock, byte, error, broken in decoded:
        damaged |= error
        if byte == ord("\n"):
            yield Line(clock, bytes(text).removesuffix(b"\r"),
                       "DAMAGED" if damaged else "LONG" if len(text) > LONGEST else "")
            text, damaged = bytearray(), False
        else:
            text.append(byte)
        if broken >= 0:
            yield Line(broken, b"", BREAK)


def refusal(text: bytes) -> tuple[str, list[int]]:
    """Return the first error of a line, and its numbers.

    Motors count from 0; C is 1 and CC -1; a position that was unsigned is signed.
    """
    word = re.match(rb"[^ 0-9+-]*", text)
    place = word.end() if word else 0
    if text[:place] not in _SYNTAX:
        return "COMMAND", []
    numbers = []
    for kind in _SYNTAX[text[:place]]:
        found = re.compile(rb" (%s)" % _KINDS[kind]).match(text, place)
        if not found:
            return "ARGUMENT", []
        place = found.end()
        if kind == "w" and re.match(rb"[^ 0-9+-]", text[place:]):
            return "ARGUMENT", []
        number = {"m": lambda given: given[3] - ord("1"), "w": lambda given: 3 - 2 * len(given)
                  }.get(kind, int)(found[1])
        low, high = _RANGES.get(kind, (number, number))
        if not low <= number <= high:
            return "RANGE", []
        numbers.append(number - 2**32 if kind == "n" and number > UP else number)
    return ("ARGUMENT" if text[place:] else ""), numbers


def begin(rates: Sequence[int]) -> bytes:
    """Return the lines that set rates and begin to move, one of the motors the other way."""
    return b"CONNECT\n" + b"".join(
        b"VEL MOT%d %d\nMOV MOT%d %s\n" % (motor, rate, motor, b"CC" if motor == 2 else b"C")
        for motor, rate in enumerate(rates, 1))


def _legal(rng: random.Random) -> bytes:
    motor, way, point = rng.randint(1, 3), rng.choice(["C", "CC"]), rng.randint(1, POINTS)
    near = "{} {} {}".format(*(rng.randrange(-80, 80) for _ in range(AXES)))
    anywhere = "{} {} {}".format(*(rng.choice(
        [0, -1, 9, rng.randrange(DOWN, UP), UP, DOWN, UP + 1, 2**32 - 9, 2**32])
        for _ in range(AXES)))
    line = rng.choice([
        "CONNECT", "CONNECT", f"MOV MOT{motor} {way}", f"MOV MOT{motor} {way}", f"STOP MOT{motor}",
        f"VEL MOT{motor} {rng.randrange(1, TOP_SPEED + 1)}",
        f"VEL MOT{motor} {rng.choice([0, 1, TOP_SPEED, TOP_SPEED + 1])}",
        f"P {point} {near}", f"P {point} {near}", f"P {point} {anywhere}",
        f"GOTO {point}", f"GOTO {point}", f"GOTO {point}", "ORIGIN", f"POS {near}",
        f"POS {anywhere}", "STATE", "ACK 1", f"ACK {rng.choice([0, 1, 2, -1])}",
        rng.choice(["", "GOTO 9", "FOO", "CONNECT ", "DISCONNECT", "DISCONNECT\nCONNECT",
                    "ORIGIN\nGOTO 1"])])
    return line.encode() + b"\n"


PROTOCOL = LineProtocol(
    _legal, quiet=(b"CONNECT 1\n", b"FOO\n", b"\n", b"VEL MOT1 0\n", b"P 8 1 1 1\n", b"GOTO 0\n",
                   b"MOV MOT4 C\n", b"POS 1 2\n", b"STOP"),
    end=b"\n", letters=b"\n\r 0129-+CMOTPVELGSNAK", longest=LONGEST, room=0, answer=24,
    begin=b"CONNECT\n",
    alive=b"DISCONNECT\nCONNECT\nPOS 0 0 0\nVEL MOT1 %d\nVEL MOT2 %d\nVEL MOT3 1000\n"
          b"P 7 5 -9 11\nGOTO 7\nBYE\n" % (TOP_SPEED, TOP_SPEED - 1))
"""Its line, for random inputs."""
