"""Places in um."""

from typing import NamedTuple

from .arguments import check_number
from .positioner_lines import AXES, STEPS_PER_UM, Steps

__all__ = ["Place", "steps_of"]


def steps_of(axis: str, um: float) -> int:
    """Return the steps of an axis that are nearest to a place in um.

    Raises
    ------
    ValueError
        If it is not a finite number.
    """
    return round(check_number(f"{axis} in um", um) * STEPS_PER_UM)


class Place(NamedTuple):
    """A place in um."""

    x: float
    y: float
    z: float

    @property
    def steps(self) -> Steps:
        """The nearest place that the motors can go to."""
        return Steps(*map(steps_of, AXES, self))

    @classmethod
    def of(cls, steps: Steps) -> "Place":
        """Return the place of so many steps."""
        return cls(*(number / STEPS_PER_UM for number in steps))
