"""Brightness of lights: their duty cycles."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tb.engines import Changes

__all__ = ["LIGHTS", "Lights"]

#: Outputs of the board that are lights. Segments and digits are active low.
LIGHTS = ("leds", "segments", "digits")

#: A digit can be on for six eighths of its slot, which is every fourth.
MOST_OF_A_DIGIT = 6 / 8 / 4


class Lights:
    """Counts for how many clocks each light was on."""

    def __init__(self) -> None:
        self._clear()

    def _clear(self) -> None:
        self._clocks = 0
        self._leds = np.zeros(8)
        self._display = np.zeros((4, 8))

    def feed(
        self, before: Mapping[str, int], changes: Changes, first: int, last: int
    ) -> None:
        """Continue with the levels after the edges `first` to `last`.

        Parameters
        ----------
        before : mapping of str to int
            Levels before the first of the changes.
        changes : Changes
            Levels from then on, none before `first`.
        first, last : int
            Clocks, counted after the edge.
        """
        inside = changes.clock >= first
        starts = np.concatenate([[first], changes.clock[inside], [last + 1]])
        weights = np.diff(starts).astype(float)
        levels = {name: np.concatenate([[before[name]], changes[name][inside]]).astype(np.uint8)
                  for name in LIGHTS}
        leds, segments, digits = _bits(levels["leds"]), _bits(~levels["segments"]), _bits(
            ~levels["digits"])[:, :4]
        self._clocks += last + 1 - first
        self._leds += weights @ leds
        self._display += (digits * weights[:, None]).T @ segments

    def take(self) -> tuple[bytes, bytes] | None:
        """Return the duty of LEDs and segments since the last call; None if there was no clock.

        Returns
        -------
        pair of bytes
            A byte each, 255 for the largest possible duty: 8 LEDs, then 32 segments, those of the
            rightmost digit first.
        """
        if not self._clocks:
            return None
        leds = _bytes(self._leds / self._clocks)
        display = _bytes(self._display / (self._clocks * MOST_OF_A_DIGIT))
        self._clear()
        return leds, display


def _bits(levels: NDArray[np.uint8]) -> NDArray[np.float64]:
    return np.unpackbits(levels[:, None], axis=1, bitorder="little").astype(float)


def _bytes(shares: NDArray[np.float64]) -> bytes:
    # A light that was on at all, however shortly, is not quite dark.
    return np.ceil(255 * shares.clip(0, 1)).astype(np.uint8).tobytes()
