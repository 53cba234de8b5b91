"""Stimulus for `positioner`: lines, right, wrong and damaged, and limit switches."""

import random

import numpy as np
from numpy.typing import NDArray

from ...stimulus import BLOCK
from ...uart import encode
from .fuzz.lines import PROTOCOL

__all__ = ["directed", "random_rows"]

SHORT = [b"MOV MOT%d %s\n" % (motor, way) for motor in (1, 2, 3) for way in (b"C", b"CC")]
"""Lines are long beside steps: such as move something at once are typed more often."""


FLOOD = b"\n" * 45
"""More lines to refuse than answers can wait."""


def directed(bit: int, seed: int, clocks: int) -> dict[str, NDArray]:
    """Type lines for so many clocks, most with time to answer and to move behind them.

    Parameters
    ----------
    bit : int
        Clocks of a bit of the line.
    seed, clocks : int
        The same ones give the same stimulus.
    """
    rng = random.Random(seed)
    line, rst = [1] * (2 * bit) + encode(PROTOCOL.begin, bit), [0] * clocks
    while len(line) < clocks:
        line += encode(_line(rng), bit) + [1] * (rng.choice([2, 10, 40, 100, 200]) * bit)
        if rng.random() < 0.02 and len(line) < clocks:
            rst[len(line) - rng.randrange(bit)] = 1
            line += [1] * bit + encode(PROTOCOL.begin, bit)
    return _columns(rst, line[:clocks], _switches(rng, clocks, 100 * bit))


def random_rows(bit: int, seed: int, block: int, rows: int = BLOCK) -> dict[str, NDArray]:
    """Return the first rows of a random block: lines close by each other, floods, and noise."""
    rng = random.Random(f"{seed} {block}")
    line = encode(PROTOCOL.begin, bit)
    while len(line) < BLOCK:
        kind = rng.randrange(16)
        if kind < 12:
            line += encode(_line(rng), bit) + [1] * (rng.choice([0, 0, 1, 30, 200]) * bit)
        elif kind == 12:
            line += encode(rng.randbytes(rng.randrange(12)), bit)
        elif kind == 13:
            line += encode(rng.choice([b"9" * 250, b"9" * 270, FLOOD]), bit)
        elif kind == 14:
            line += [rng.randrange(2) for _ in range(rng.randrange(20 * bit))]
        else:
            line += [0] * rng.randrange(25 * bit) + [1] * rng.choice([1, 2, 3, 4, bit])
    rst = [0] * BLOCK
    for _ in range(rng.randrange(3)):
        rst[rng.randrange(BLOCK)] = 1
    columns = _columns(rst, line[:BLOCK], _switches(rng, BLOCK, 100 * bit))
    return {name: column[:rows] for name, column in columns.items()}


def _line(rng: random.Random) -> bytes:
    """Return a line: right, wrong, or with bytes changed."""
    kind = rng.randrange(10)
    line = bytearray(rng.choice(SHORT) if kind < 4 else PROTOCOL.legal(rng) if kind < 9
                     else rng.choice(PROTOCOL.quiet))
    if rng.random() < 0.15:
        for _ in range(rng.randrange(1, 4)):
            place = rng.randrange(len(line) + 1)
            line[place:place + rng.randrange(2)] = bytes(
                rng.choices([*PROTOCOL.letters, rng.randrange(256)], k=rng.randrange(3)))
    return bytes(line)


def _switches(rng: random.Random, clocks: int, longest: int) -> list[int]:
    """Press some switches now and then, and let them go; some bounce."""
    levels: list[int] = []
    while len(levels) < clocks:
        pressed = rng.randrange(8) if rng.random() < 0.3 else 0
        for _ in range(rng.choice([0, 0, 3])):
            levels += [pressed, 0] * rng.randrange(1, 4)
        levels += [pressed] * rng.randrange(1, longest)
    return levels[:clocks]


def _columns(*levels: list[int]) -> dict[str, NDArray]:
    return {name: np.array(column, np.uint8)
            for name, column in zip(("rst", "rx", "limits"), levels, strict=True)}
