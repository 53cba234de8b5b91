"""A pen that hangs from two strings, simulated from the coil words of their motors.

It knows how long the strings are, and that what hangs from both is in gravity's triangle; nothing
of places, ticks or lines.
"""

from collections.abc import Iterable
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fresa.drive import HALF_STEP

__all__ = ["StringPlant", "WallPlant", "hanging"]


def hanging(left: ArrayLike, right: ArrayLike, width: float) -> NDArray[np.complex128]:
    """Return where a point hangs: x to the right of the left pulley, and i times y, down.

    Where one string is slack it hangs below the pulley of the other one. Where the strings do not
    reach from pulley to pulley it is where they are torn.

    Parameters
    ----------
    left, right : array
        Lengths of the strings in mm.
    width : float
        From pulley to pulley in mm.
    """
    left, right = np.asarray(left, float), np.asarray(right, float)
    x = (left**2 - right**2 + width**2) / (2 * width)
    places = x + 1j * np.sqrt(np.maximum(0, left**2 - x**2))
    places = np.where(x <= 0, 1j * left, np.where(x >= width, width + 1j * right, places))
    whole = left + right
    return np.where(whole < width, width * left / np.maximum(whole, 1e-9), places)


class StringPlant:
    """A motor with its string, and the end switch of that.

    Parameters
    ----------
    length : int
        Of the string at first, in half steps.
    switch : int
        The switch is on where the string is shorter.
    flipped : bool
        The motor turns the other way.

    Attributes
    ----------
    steps : int
        Half steps that were made, in both directions.
    jumps : int
        Words that no motor can follow.
    nearest : int
        Least clocks from a step to the next.
    """

    def __init__(self, length: int, *, switch: int = 0, flipped: bool = False) -> None:
        self.length, self.switch, self.flipped = length, switch, flipped
        self.steps = self.jumps = 0
        self.nearest = 1 << 62
        self._phase: int | None = None
        self._clock = -(1 << 62)

    @property
    def closed(self) -> bool:
        """Whether the switch is on."""
        return self.length < self.switch

    def feel(self, clock: int, word: int) -> None:
        """Follow a coil word; without power the motor stays."""
        if word == 0:
            return
        phase = HALF_STEP.index(word)
        if self._phase is None:
            self._phase = phase
        way = (phase - self._phase + 4) % 8 - 4
        self._phase = phase
        if abs(way) > 1:
            self.jumps += 1
        elif way:
            self.steps += 1
            self.nearest = min(self.nearest, clock - self._clock)
            self._clock = clock
            self.length += -way if self.flipped else way


class WallPlant:
    """Both strings, and the pen that hangs from them.

    Parameters
    ----------
    width : float
        From pulley to pulley in mm.
    steps_per_mm : float
        Half steps of string.
    x, y : float
        Where the pen hangs at first, in mm from the left pulley, y down.
    switch_mm : float
        A string that is shorter closes its switch. There its length is 0.
    period : int
        Least clocks from a step to the next.

    Attributes
    ----------
    left, right : StringPlant
        The strings.
    torn : bool
        They were too short for the way between the pulleys.
    """

    def __init__(self, width: float, steps_per_mm: float, x: float, y: float, *,
                 switch_mm: float = 5, period: int = 1) -> None:
        self.width, self.steps_per_mm, self.period = width, steps_per_mm, period
        self.left, self.right = (
            StringPlant(round(steps_per_mm * (sqrt(across**2 + y**2) + switch_mm)),
                        switch=round(steps_per_mm * switch_mm)) for across in (x, width - x))
        self.torn = False

    outputs = "left", "right"
    """Outputs of a machine that move it: coil words."""

    @property
    def limits(self) -> int:
        """Levels of the end switches."""
        return self.left.closed | self.right.closed << 1

    @property
    def levels(self) -> dict[str, int]:
        """Inputs of a machine, by their names."""
        return {"limits": self.limits}

    @property
    def free(self) -> int:
        """Clocks in which no switch closes or opens."""
        return self.period * max(1, min(abs(each.length - each.switch)
                                        for each in (self.left, self.right)) - 1)

    @property
    def pen(self) -> tuple[float, float]:
        """Where the pen hangs, in mm from the left pulley, y down."""
        left, right = ((each.length - each.switch) / self.steps_per_mm
                       for each in (self.left, self.right))
        self.torn |= left + right < self.width
        place = complex(hanging(left, right, self.width))
        return place.real, place.imag

    def feel(self, rows: Iterable[tuple[int, int, int]]) -> None:
        """Follow clocks and coil words of the left and right motor."""
        for clock, left, right in rows:
            self.left.feel(clock, left)
            self.right.feel(clock, right)
