"""Frames among received bytes: from a colon to an end of line."""

from collections.abc import Iterator
from typing import NamedTuple

from ..uart import DecodedByte

__all__ = ["Frame", "frames"]


class Frame(NamedTuple):
    """A complete frame: the clock of its end, its text, and what is wrong with its bytes."""

    clock: int
    text: bytes
    wrong: str


def frames(received: Iterator[DecodedByte], ends: bytes, longest: int) -> Iterator[Frame]:
    """Yield the frames among bytes: from ``:`` to one of `ends`, begun anew at each ``:``.

    A byte outside that lacks its stop bit may have been a ``:``, and begins a damaged one.
    """
    text: bytearray | None = None
    damaged = False
    for clock, byte, error, _ in received:
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
