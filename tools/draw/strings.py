"""Strings with motors, by whole arrays of coil words, and how far they move a pen."""

import numpy as np
from numpy.typing import NDArray

from fresa.drive import HALF_STEP

from .curves import Polyline

__all__ = ["MotorString", "step_mm"]

_PHASES = np.full(16, -1, np.int8)
_PHASES[list(HALF_STEP)] = np.arange(8, dtype=np.int8)


class MotorString:
    """A motor with its string.

    Parameters
    ----------
    length : int
        Of the string at first, in half steps.

    Attributes
    ----------
    length : int
        Of the string now.
    steps : int
        Half steps that were made, in both directions.
    jumps : int
        Words that no motor can follow.
    """

    def __init__(self, length: int) -> None:
        self.length = length
        self.steps = self.jumps = 0
        self._phase = -1

    def feel(self, words: NDArray[np.int64]) -> NDArray[np.int64]:
        """Follow coil words; return the length after each. Without power the motor stays."""
        phases = _PHASES[words]
        self.jumps += int(np.count_nonzero((phases < 0) & (words != 0)))
        powered = np.flatnonzero(phases >= 0)
        if not len(powered):
            return np.full(len(words), self.length)
        first = phases[powered[0]] if self._phase < 0 else self._phase
        turns = (np.diff(phases[powered], prepend=np.int8(first)) + 4) % 8 - 4
        self._phase = int(phases[powered[-1]])
        jumps = np.abs(turns) > 1
        self.jumps += int(np.count_nonzero(jumps))
        turns[jumps] = 0
        changes = np.zeros(len(words), np.int64)
        changes[powered] = turns
        self.steps += int(np.count_nonzero(turns))
        lengths = self.length + changes.cumsum()
        self.length = int(lengths[-1])
        return lengths


def step_mm(places: Polyline, width: float, step: float) -> NDArray[np.float64]:
    """Return how far a step of both strings moves a pen at most, at places on the wall.

    Parameters
    ----------
    places : array of complex
        On the wall, below the pulleys.
    width : float
        From pulley to pulley in mm.
    step : float
        Of a string, in mm.
    """
    angle = np.abs(np.angle(places / (places - width))) / 2  # half of that between the strings
    return step / np.maximum(1e-9, np.minimum(np.sin(angle), np.cos(angle)))
