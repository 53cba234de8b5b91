"""From a file to the lines on the wall: what `python -m tools.draw` and others share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..console import UserError
from .curves import Polyline
from .order import Ordered, Silent, ordered
from .svg import Drawing
from .timing import Speeds, seconds
from .wall import Part, Placement, Wall, flatten, place

__all__ = ["Plan", "length", "pens_of", "plan"]

MOST_POINTS = 4_000_000


@dataclass(frozen=True)
class Plan:
    """A drawing on the wall, ready to be drawn.

    Attributes
    ----------
    parts : list of Part
        What each pen draws, in its order: places in mm, y down.
    wall : Wall
        The wall.
    placement : Placement
        How the drawing comes on it.
    orders : list of Ordered
        What sorting has saved, of each part.
    """

    parts: list[Part]
    wall: Wall
    placement: Placement
    orders: list[Ordered]

    @property
    def lines(self) -> list[Polyline]:
        """All lines, as they are drawn."""
        return [line for part in self.parts for line in part.lines]

    def facts(self, speeds: Speeds) -> dict[str, Any]:
        """Return the figures, for JSON."""
        down, up = seconds(self.parts, self.wall.resting, speeds)
        low, high = self.placement.low, self.placement.high
        return {
            "wall_mm": [self.wall.width, self.wall.height],
            "drawing_mm": {"left": round(low.real, 3), "top": round(low.imag, 3),
                           "width": round((high - low).real, 3),
                           "height": round((high - low).imag, 3),
                           "scale": round(self.placement.scale, 6)},
            "pens": [{"name": part.name, "colour": part.colour, "lines": len(part.lines),
                      "down_mm": round(length(part.lines), 1)} for part in self.parts],
            "lines": len(self.lines),
            "points": sum(map(len, self.lines)),
            "twice": sum(order.twice for order in self.orders),
            "down_mm": round(length(self.lines), 1),
            "up_mm": round(sum(order.after for order in self.orders), 1),
            "up_as_in_file_mm": round(sum(order.before for order in self.orders), 1),
            "sorted_by": self.orders[0].by,
            "seconds": round(down + up, 1),
            "seconds_down": round(down, 1),
            "seconds_up": round(up, 1),
        }


def length(lines: Sequence[Polyline]) -> float:
    """Return the length of lines, in mm."""
    return float(sum(np.abs(np.diff(line)).sum() for line in lines))


def pens_of(drawing: Drawing, pens: str | None) -> str:
    """Return how shapes come to pens, if it is not said: by layers, if Inkscape has made some."""
    return pens or ("layer" if drawing.has_layers else "one")


def plan(drawing: Drawing, wall: Wall, *, pens: str | None = None, tolerance: float = 0.1,
         width: float | None = None, scale: float | None = None, at: complex | None = None,
         effort: float = 10.0, vpype: bool | None = None,
         progress: Callable[[int, str, str], Any] = Silent) -> Plan:
    """Bring a drawing onto the wall, and sort its lines.

    Half of the tolerance is for chords of curves, and half for points that are left out.

    Parameters
    ----------
    drawing : Drawing
        As `read_drawing` gives it.
    wall : Wall
        Where it comes.
    pens : str, optional
        ``layer``, ``colour`` or ``one``; see `pens_of`.
    tolerance : float
        How far a line on the wall may be from the curve, in mm.
    width, scale, at : optional
        As of `place`.
    effort, vpype, progress : optional
        As of `ordered`.

    Raises
    ------
    UserError
        If it does not fit, or has too many points.
    """
    placement = place(*drawing.bounds(), wall, width=width, scale=scale, at=at)
    parts, orders = [], []
    flat = flatten(drawing, placement, tolerance / 2, pens_of(drawing, pens))
    if sum(len(line) for part in flat for line in part.lines) > MOST_POINTS:
        raise UserError(f"the drawing has more than {MOST_POINTS} points: allow a larger "
                        "--tolerance, or split it")
    for part in flat:
        order = ordered(part.lines, tolerance / 2, wall.resting, effort=effort, vpype=vpype,
                        progress=progress)
        orders.append(order)
        parts.append(part._replace(lines=order.lines))
    return Plan(parts, wall, placement, orders)
