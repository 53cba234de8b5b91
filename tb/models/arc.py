"""Model of the formulas of an arc: what they stand for, by the text of what they are to do.

In floating-point numbers, whose 53 bits are far more than what is compared.
"""

from collections.abc import Sequence
from math import asin, atan2, hypot, pi, sqrt

from .gcode_language import RefusedLine, centre_by_radius, check_radii

__all__ = ["PLANES", "ArcPath", "verdict"]

PLANES = ((0, 1, 2), (2, 0, 1), (1, 2, 0))
"""First and second axis of XY, ZX and YZ, and the one across."""

SMALLEST = 5e-7
"""Sweep in rad up to which an arc is a full circle more."""


def verdict(end: tuple[int, int], *, centre: tuple[int, int] | None, radius: int = 0,
            clockwise: bool = False, steps: int = 0) -> int:
    """Return GRBL's code for an arc from (0, 0), in nm, or 0.

    `steps` are those per metre of the finer axis of the plane; 0 if they do not matter.
    """
    try:
        if centre is None:
            centre_by_radius(*end, radius, clockwise=clockwise, steps_per_metre=steps)
        else:
            check_radii(*centre, *end, steps_per_metre=steps)
    except RefusedLine as refused:
        return refused.args[0]
    return 0


class ArcPath:
    """An arc or a helix, in nm.

    Parameters
    ----------
    start, end : sequence of int
        Positions of X, Y and Z.
    centre : sequence of int
        From the start to the centre, by the first and second axis of the plane.
    plane : int
        Number in `PLANES`.
    clockwise : bool
        It goes the other way round.
    """

    def __init__(self, start: Sequence[int], end: Sequence[int], centre: Sequence[int], *,
                 plane: int, clockwise: bool) -> None:
        self.axes = PLANES[plane]
        a, b, c = self.axes
        self.way = -1 if clockwise else 1
        self.start = [-each for each in centre]
        self.end = [end[a] - start[a] - centre[0], end[b] - start[b] - centre[1]]
        self.across = end[c] - start[c]
        self.radius = hypot(*self.start)
        cross = self.start[0] * self.end[1] - self.start[1] * self.end[0]
        dot = self.start[0] * self.end[0] + self.start[1] * self.end[1]
        sweep = self.way * atan2(cross, dot) if cross else atan2(0, dot)
        self.sweep = sweep + 2 * pi if sweep <= SMALLEST else sweep
        self.arc = self.radius * self.sweep
        self.length = hypot(self.arc, self.across)

    def _unit(self, vector: Sequence[int]) -> list[float]:
        size = hypot(*vector) * self.length / self.arc
        unit = [0.0, 0.0, 0.0]
        unit[self.axes[0]] = -self.way * vector[1] / size
        unit[self.axes[1]] = self.way * vector[0] / size
        unit[self.axes[2]] = self.across / self.length
        return unit

    def units(self) -> tuple[list[float], list[float]]:
        """Return the directions at the start and at the end, of length 1."""
        return self._unit(self.start), self._unit(self.end)

    def _along(self, plane: float, across: float) -> float:
        limit = plane * self.length / self.arc
        return min(limit, across * self.length / abs(self.across)) if self.across else limit

    def acceleration(self, limits: Sequence[int]) -> float:
        """Return the highest acceleration along it."""
        a, b, c = self.axes
        return self._along(min(limits[a], limits[b]) / 2, limits[c])

    def speed(self, feed: int, speeds: Sequence[int], accelerations: Sequence[int]) -> float:
        """Return the highest speed along it, but for what the clock allows."""
        a, b, c = self.axes
        top = min(speeds[a], speeds[b], self.top(accelerations))
        return min(feed, self._along(top, speeds[c]))

    def top(self, accelerations: Sequence[int]) -> float:
        """Return the speed on the circle that 0.866 of the acceleration allows."""
        a, b, _ = self.axes
        return sqrt(0.866 * min(accelerations[a], accelerations[b]) * self.radius)

    def exponent(self, steps: float) -> int:
        """Return that of the least power of two that is no less than the radius in steps.

        It is 1 at least; `steps` are those per metre of the finer axis.
        """
        exponent = 1
        while 1 << exponent < self.radius * steps / 10**9:
            exponent += 1
        return exponent

    def turns(self, exponent: int) -> float:
        """Return its number of half turns."""
        return self.sweep / asin(2.0 ** -(exponent + 4))
