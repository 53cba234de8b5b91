"""Lines of the mill's order source: what is asked, and what is answered. No I/O."""

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from .arguments import check_whole

__all__ = ["LAST_NUMBER", "Answer", "AnswerReader", "Kind", "Order", "Outcome", "request"]

LAST_NUMBER = (1 << 24) - 1
"""The highest number of an order: most orders of a job."""

DIGITS = 22
"""Digits of an answer without its check."""

LENGTH = DIGITS + 8


class Kind(IntEnum):
    """What a request is for."""

    QUERY = 0
    OPEN = 1
    GO = 2
    UP = 3
    DOWN = 4


class Outcome(IntEnum):
    """What became of a request."""

    REPORTED = 0
    OPENED = 1
    TAKEN = 2
    AGAIN = 3
    FULL = 4
    BUSY = 5
    UNEXPECTED = 6
    CLOSED = 7
    MANUAL = 8
    DAMAGED = 9
    UNKNOWN = 10


@dataclass(frozen=True, slots=True)
class Order:
    """What the mill is to do: to go to a place, or to raise or lower its tool.

    Attributes
    ----------
    kind : Kind
        ``GO``, ``UP`` or ``DOWN``.
    x, y : int
        Steps from the origin, 0 to 65 535, of a ``GO``.

    Raises
    ------
    ValueError
        If it is none of these, or a step is no whole number or out of range.
    """

    kind: Kind
    x: int = 0
    y: int = 0

    def __post_init__(self) -> None:
        if self.kind not in (Kind.GO, Kind.UP, Kind.DOWN):
            raise ValueError(f"an order is to go, up or down, not {self.kind!r}")
        object.__setattr__(self, "kind", Kind(self.kind))
        for name, place in (("x", self.x), ("y", self.y)):
            object.__setattr__(self, name, check_whole(name, place, 0, 0xFFFF))

    def __str__(self) -> str:
        return f"go {self.x} {self.y}" if self.kind == Kind.GO else self.kind.name.lower()


@dataclass(frozen=True, slots=True)
class Answer:
    """What the mill says.

    Attributes
    ----------
    outcome : Outcome
        What became of the request.
    error, stopped, manual : bool
        It refuses an order; it is stopped until reset; it is in manual mode.
    session : int
        The session that is open; 0 if none is.
    taken, done : int
        The numbers of the last order that it took, and of the last that it has carried out.
    """

    outcome: Outcome
    error: bool
    stopped: bool
    manual: bool
    session: int
    taken: int
    done: int


def request(kind: int, session: int = 0, number: int = 0, x: int = 0, y: int = 0) -> bytes:
    """Return the line of a request."""
    digits = f"{kind:02X}{session:08X}{number:06X}{x:04X}{y:04X}"
    return f":{digits}{check(digits)}\r".encode()


def check(digits: str) -> str:
    """Return the CRC-32 of an even number of digits, its lowest digit first.

    Digits go into it one by one, each from its lowest bit; zlib takes two at once, the first of
    which is the lower half of a byte.
    """
    return f"{zlib.crc32(bytes.fromhex(digits[::-1])[::-1]):08X}"[::-1]


def read_answer(digits: str) -> Answer | None:
    """Return what an answer's digits say, or None if they are not right."""
    body = digits[:DIGITS]
    if check(body) != digits[DIGITS:] or int(body[0], 16) > max(Outcome):
        return None
    state = int(body[1], 16)
    return Answer(Outcome(int(body[0], 16)), bool(state & 1), bool(state & 2), bool(state & 4),
                  int(body[2:10], 16), int(body[10:16], 16), int(body[16:], 16))


class AnswerReader:
    """Finds answers in bytes, whatever comes between them. Memory is bounded."""

    def __init__(self) -> None:
        self._begun: bytearray | None = None

    def feed(self, data: bytes) -> Sequence[Answer]:
        """Take bytes; return the answers that end in them."""
        answers = []
        for byte in data:
            if byte == ord("="):
                self._begun = bytearray()
            elif self._begun is None:
                continue
            elif byte in b"\r\n":
                if re.fullmatch(rb"[0-9A-F]{%d}" % LENGTH, self._begun):
                    answers.append(read_answer(self._begun.decode()))
                self._begun = None
            elif len(self._begun) <= LENGTH:
                self._begun.append(byte)
        return [answer for answer in answers if answer is not None]

    def clear(self) -> None:
        """Forget the line that has begun."""
        self._begun = None
