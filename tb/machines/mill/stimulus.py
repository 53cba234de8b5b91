"""Stimulus for the mill: orders that wait for it, and pins each at a rate of its own."""

import random
from collections.abc import Iterator
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from ...stimulus import BLOCK
from .actions import Action, Hold, Jog, Mode, Order, Reset, Select, Stop, Together, record
from .model import MillInputs, MillModel

__all__ = ["directed", "orders", "random_rows"]


def orders(seed: int) -> Iterator[Action]:
    """Give actions without end, as people and order sources do them, and as they should not."""
    rng = random.Random(seed)

    def near() -> int:
        return rng.choice([rng.randrange(12), rng.randrange(12), rng.randrange(60)])

    yield from (Reset(), Mode(1))
    while True:
        what = rng.randrange(16)
        if what < 5:
            yield Order(near(), near(), start=rng.randint(1, 3))
        elif what < 7:
            yield Order(up=1) if rng.random() < 0.5 else Order(down=1)
        elif what == 7:  # refused: both ways at once
            yield Order(up=1, down=1)
        elif what == 8:  # refused unless straight or diagonal: milling to anywhere
            yield Order(down=1)
            yield Order(near(), near())
            yield Order(up=1)
        elif what == 9:  # an order into a movement
            yield Order(near(), near(), wait=rng.randrange(40))
            yield Order(near(), near(), up=rng.getrandbits(1), start=rng.randint(1, 30))
        elif what == 10:  # never let go of start
            yield Order(near(), near(), start=rng.randint(20, 200))
        elif what == 11:  # manual mode, perhaps in the middle of a movement
            if rng.random() < 0.5:
                yield Order(near(), near(), wait=rng.randrange(30))
            yield Mode(0)
            yield Hold(rng.randint(1, 3))
            for _ in range(rng.randint(1, 6)):
                yield Jog(rng.getrandbits(6), rng.randint(1, 40), release=rng.random() < 0.8)
            yield Mode(1)
        elif what == 12:  # switches that are on already when manual mode comes
            yield Together((("jog", rng.getrandbits(6)), ("mode", 0)), rng.randint(1, 20))
            yield Together((("jog", rng.getrandbits(6)), ("mode", 1)), rng.randint(1, 5))
        elif what == 13:
            yield Order(near(), near(), wait=rng.randrange(60))
            yield Stop(rng.randint(1, 3))
            yield Order(near(), near(), wait=rng.randrange(30))
            yield Reset(rng.randint(1, 3))
        elif what == 14:
            yield Order(near(), near(), wait=rng.randrange(60))
            yield Reset(rng.choice([1, 1, 2, 10]))
        else:
            yield Select(rng.randrange(4))
            yield Hold(rng.randint(1, 100))


def directed(model: MillModel, seed: int, clocks: int) -> dict[str, NDArray]:
    """Apply `orders` to a model for so many clocks, and return what its pins were given."""

    def enough() -> Iterator[Action]:
        for action in orders(seed):
            if model.clock >= clocks:
                break
            yield action

    recording = record(model, enough())
    return {name: np.array(row[:clocks], np.uint16) for name, row in recording.stimulus.items()}


def random_rows(seed: int, block: int, rows: int = BLOCK) -> dict[str, NDArray]:
    """Return the first rows of a block of random stimulus.

    Each row has 64 random bits, and each pin its own of them.
    """
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, block])))
    bits = rng.integers(0, 1 << 64, BLOCK, np.uint64)
    low, high = bits.astype(np.uint32), (bits >> np.uint64(32)).astype(np.uint32)

    def rare(word: NDArray[np.uint32], place: int, width: int) -> NDArray[np.bool_]:
        """Once in 2 ** width clocks."""
        mask = np.uint32((1 << width) - 1 << place)
        return (word & mask) == 0

    def held(changes: NDArray[np.bool_], values: NDArray) -> NDArray:
        return values[np.cumsum(changes) % len(values)]

    far = rng.integers(0, 16, (2, 4096), np.uint16) == 0
    places = np.where(far, rng.integers(0, 1 << 16, far.shape, np.uint16),
                      rng.integers(0, 10, far.shape, np.uint16))
    places[1, ::4] = places[0, ::4]  # diagonals
    jogs = rng.integers(0, 64, 8192, np.uint16)
    moves = rare(high, 0, 6)
    tool = rare(high, 6, 1)
    made = {
        "rst": rare(low, 0, 9),
        "mode": held(rare(low, 9, 9), np.array([1, 1, 0], np.uint8)),
        "position_x": held(moves, places[0]),
        "position_y": held(moves, places[1]),
        "up": tool & rare(high, 7, 3),
        "down": tool & rare(high, 10, 3),
        "start": rare(low, 18, 2),
        "counter_select": held(rare(high, 13, 5), jogs & 3),
        "jog": held(rare(high, 18, 4), jogs & rng.integers(0, 64, 8192, np.uint16)),
        "stop": rare(low, 20, 11),
    }
    return {field.name: made[field.name][:rows] for field in fields(MillInputs)}
