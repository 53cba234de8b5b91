"""The profile of a block in real numbers of 80 bits: constant accelerations and a top speed."""

import numpy as np

from tb.models.profile import Block

__all__ = ["FRACTION", "STEPS_PER_MM", "ideal"]

FRACTION = 16
"""Bits of the fraction of speeds."""

STEPS_PER_MM = (40, 80, 160, 250, 400, 1000, 3200)
"""Those of programs that are random."""


def ideal(block: Block, unit: np.longdouble, begin: int, end: int, ticks: np.ndarray
          ) -> np.ndarray:
    """Return the exact clocks of ticks, from the begin of a block, between two squared speeds.

    Ticks may be real numbers; `unit` is the length of one, in nm a second and clocks.
    """
    real = np.longdouble
    energy, first, last = real(block.energy), real(begin), real(end)
    count, top = real(1 << block.log2_ticks), real(block.nominal)
    rises = (last - first + energy * count) / (2 * energy)
    falls = rises
    peak = first + energy * rises
    if peak > top:
        rises, falls = (top - first) / energy, count - (top - last) / energy
        peak = top

    def ramp(square, made):  # from this square up or, backwards, down to it
        root = np.sqrt(square) + np.sqrt(np.maximum(square + energy * made, 0))
        return np.divide(2 * made, root, out=np.zeros_like(made), where=made > 0)

    n = ticks.astype(real)
    up, down = np.minimum(n, rises), np.maximum(n - falls, 0)
    level = np.minimum(np.maximum(n - rises, 0), falls - rises)
    before = ramp(last, np.full_like(n, count - falls)) - ramp(last, count - falls - down)
    return unit * (ramp(first, up) + level / np.sqrt(peak) + before)
