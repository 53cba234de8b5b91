"""Places in um."""

import math
from typing import NamedTuple

from .positioner_lines import STEPS_PER_UM, Steps

__all__ = ["Place"]


class Place(NamedTuple):
    """A place in um."""

    x: float
    y: float
    z: float

    @property
    def steps(self) -> Steps:
        """The nearest place that the motors can go to."""
        if not all(map(math.isfinite, self)):
            raise ValueError(f"a place is three numbers of um, not {tuple(self)}")
        return Steps(*(round(um * STEPS_PER_UM) for um in self))

    @classmethod
    def of(cls, steps: Steps) -> "Place":
        """Return the place of so many steps."""
        return cls(*(number / STEPS_PER_UM for number in steps))
