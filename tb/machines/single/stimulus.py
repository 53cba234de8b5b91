"""Stimulus for `single`: frames on its line, right, wrong and damaged."""

import random
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...stimulus import BLOCK
from ...uart import encode
from .model import SingleInputs, SingleModel

__all__ = ["directed", "frames", "random_rows"]

WORDS = [b"x?", b"v?", b"X?", b"d", b"e0", b"e1", b"e1", b"e2", b"E", b"x", b"v0", b"", b"?", b"dd",
         b"x-1", b"x+1", b"x 1", b"x12a", b"x?1", b"v?a", b"ex", b"x10000", b"x65536", b"v60000",
         b"v59999", b"v00700", b"x9999"]


def frames(rng: random.Random) -> Iterator[bytes]:
    """Give frames without end: right ones, wrong ones, and any of them with bytes changed."""
    while True:
        kind = rng.randrange(16)
        if kind < 6:
            frame = b":x%d\r" % rng.randrange(rng.choice([9, 400, 10_000, 20_000]))
        elif kind < 8:
            frame = b":v%d\r" % rng.choice([rng.randrange(1, 60_000), rng.randrange(20_000, 60_000),
                                            rng.randrange(99_999)])
        elif kind == 8:
            zeros = b"0" * rng.choice([3, 122, 124, 125, 126, 140])
            frame = b":" + rng.choice([b"x", b"e", b""]) + zeros + rng.choice([b"", b"1"]) + b"\r"
        else:
            frame = b":" + rng.choice(WORDS) + b"\r"
        if rng.random() < 0.2:
            mutated = bytearray(frame)
            for _ in range(rng.randrange(1, 4)):
                place = rng.randrange(len(mutated) + 1)
                mutated[place:place + rng.randrange(2)] = bytes(
                    rng.choices([*b":\r?0xvedXVED +", rng.randrange(256)], k=rng.randrange(3)))
            frame = bytes(mutated)
        yield frame


def directed(model: SingleModel, seed: int, clocks: int) -> dict[str, NDArray]:
    """Send frames to a model for so many clocks, each when that before was answered."""
    rng = random.Random(seed)
    pins = SingleInputs(rx=1)
    levels: dict[str, list[int]] = {"rst": [], "rx": []}

    def drive(row: int, rst: int = 0) -> None:
        pins.rx, pins.rst = row, rst
        model.edge(pins)
        levels["rx"].append(row)
        levels["rst"].append(rst)

    source = frames(rng)
    ready = False  # the motor is fast: it is slow after reset
    while len(levels["rx"]) < clocks:
        for level in encode(next(source) if ready else b":v40000\r", model.bit):
            drive(level)
        for _ in range(rng.choice([2, 2, 2, 120]) * model.bit):
            drive(1)
        while model.answers and len(levels["rx"]) < clocks:
            drive(1)
        ready = rng.random() > 0.02
        if not ready:
            drive(1, rst=1)
    return {name: np.array(row[:clocks], np.uint8) for name, row in levels.items()}


def random_rows(bit: int, seed: int, block: int, rows: int = BLOCK) -> dict[str, NDArray]:
    """Return the first rows of a random block: frames close by each other, bytes, and noise."""
    rng = random.Random(f"{seed} {block}")
    line: list[int] = []
    source = frames(rng)
    while len(line) < BLOCK:
        kind = rng.randrange(10)
        if kind < 6:
            line += encode(next(source), bit) + [1] * (rng.choice([0, 0, 1, 30, 200]) * bit)
        elif kind < 8:
            line += encode(rng.randbytes(rng.randrange(12)), bit)
        elif kind == 8:
            line += [rng.randrange(2) for _ in range(rng.randrange(20 * bit))]
        else:
            line += [0] * rng.randrange(25 * bit) + [1] * rng.choice([1, 2, 3, 4, bit])
    resets = {rng.randrange(BLOCK) for _ in range(rng.randrange(4))}
    rst = np.zeros(BLOCK, np.uint8)
    rst[list(resets)] = 1
    return {"rst": rst[:rows], "rx": np.array(line[:rows], np.uint8)}
