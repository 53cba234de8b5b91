"""Switches that are pressed and let go at random, and what of it is seen at an input."""

import random
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .line import FRAME, Levels
from .pieces import Piece

__all__ = ["pressing"]


def pressing(pieces: Iterator[Piece], switches: int, seed: int, period: int) -> Iterator[Piece]:
    """Press switches while pieces are sent, and let them go where the first and the last are.

    The line is the same as without: what is pressed is drawn by itself.
    """
    runs = _runs(random.Random(f"switches {seed}"), switches, FRAME * period)
    level = left = 0
    for piece in pieces:
        if piece.kind in ("rest", "alive"):
            yield piece
            continue
        pressed: Levels = np.zeros(len(piece.levels), np.uint8)
        place = 0
        while place < len(pressed):
            if not left:
                level, left = next(runs)
            pressed[place:place + left] = level
            taken = min(left, len(pressed) - place)
            place, left = place + taken, left - taken
        yield replace(piece, pressed=pressed) if pressed.any() else piece


def _runs(rng: random.Random, switches: int, byte: int) -> Iterator[tuple[int, int]]:
    """Give what is pressed, and for how many clocks: one of them mostly, some contacts bounce."""
    while True:
        yield 0, rng.randint(1, rng.choice([40, 3 * byte, 30 * byte]))
        on = rng.choice([1 << rng.randrange(switches)] * 3 + [rng.getrandbits(switches)])
        for _ in range(rng.choice([0, 0, 3])):
            yield on, rng.randint(1, 9)
            yield 0, rng.randint(1, 9)
        yield on, rng.randint(1, rng.choice([1, 1, 20, 90, 5 * byte, 20 * byte]))
