"""Switches that are pressed and let go at random, and what of it is seen at an input."""

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..uart import FRAME
from .inputs import Input

__all__ = ["press_switches", "switch_levels"]


def press_switches(inputs: Iterator[Input], switches: int, seed: int,
                   period: int) -> Iterator[Input]:
    """Press switches while pieces are sent, and let them go where the first and the last are.

    The line is the same as without: what is pressed is drawn by itself. Pieces with switches of
    their own keep these.
    """
    runs = _runs(random.Random(f"switches {seed}"), switches, FRAME * period)
    level = left = 0
    for item in inputs:
        if item.kind in ("rest", "alive") or item.pressed is not None:
            yield item
            continue
        pressed = np.zeros(len(item.levels), np.uint16)
        place = 0
        while place < len(pressed):
            if not left:
                level, left = next(runs)
            pressed[place:place + left] = level
            accepted = min(left, len(pressed) - place)
            place, left = place + accepted, left - accepted
        yield replace(item, pressed=pressed) if pressed.any() else item


def _runs(rng: random.Random, switches: int, byte: int) -> Iterator[tuple[int, int]]:
    """Yield what is pressed, and for how many clocks: one of them mostly, some contacts bounce."""
    while True:
        yield 0, rng.randint(1, rng.choice([40, 3 * byte, 30 * byte]))
        on = rng.choice([1 << rng.randrange(switches)] * 3 + [rng.getrandbits(switches)])
        for _ in range(rng.choice([0, 0, 3])):
            yield on, rng.randint(1, 9)
            yield 0, rng.randint(1, 9)
        yield on, rng.randint(1, rng.choice([1, 1, 20, 90, 5 * byte, 20 * byte]))


def switch_levels(inputs: Sequence[Input]) -> NDArray[np.integer]:
    """Return the switches in each clock of some inputs, a bit each."""
    return np.concatenate([np.zeros(len(item.levels), np.uint16) if item.pressed is None
                           else item.pressed for item in inputs])
