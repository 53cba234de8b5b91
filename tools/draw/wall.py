"""The wall, and where a drawing comes on it.

Places on the wall are complex numbers in mm, x to the right and y down from its upper left corner,
as the plotter's own commands have them. G-code has y upwards from the lower left corner.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from ..console import UserError
from .curves import Affine, Polyline
from .svg import MM_PER_PX, Drawing, Shape

__all__ = ["Part", "Placement", "Wall", "flatten", "place"]

LEAST_PX = 1e-9
"""Extent of a drawing that has none: it is drawn as a point."""


@dataclass(frozen=True)
class Wall:
    """A wall with pulleys at its upper corners.

    Attributes
    ----------
    width, height : float
        Of the wall, in mm.
    top : float
        How far below the pulleys is drawn at most, in mm: near their line half a step of string is
        worth much.
    margin : float
        What is left free at the left, at the right and below, in mm.
    rest : complex, optional
        Where the pen is before and after a job: the middle of the wall if not given.
    """

    width: float = 1768.0
    height: float = 1768.0
    top: float = 200.0
    margin: float = 100.0
    rest: complex | None = None

    def __post_init__(self) -> None:
        if self.low.real >= self.high.real or self.low.imag >= self.high.imag:
            raise UserError("the margins leave no place on the wall")
        if not (0 <= self.resting.real <= self.width and 0 <= self.resting.imag <= self.height):
            raise UserError(f"the place of rest, {_point(self.resting)}, is not on the wall")
        if self.resting.imag < self.top:
            raise UserError(f"the place of rest, {_point(self.resting)}, is above where the "
                            f"plotter draws, which begins {self.top:g} mm below the pulleys: see "
                            "--rest and --top")

    @property
    def low(self) -> complex:
        """Upper left corner of the area that is drawn on."""
        return complex(self.margin, self.top)

    @property
    def high(self) -> complex:
        """Lower right corner of that area."""
        return complex(self.width - self.margin, self.height - self.margin)

    @property
    def resting(self) -> complex:
        """Where the pen is before and after a job."""
        return complex(self.width, self.height) / 2 if self.rest is None else self.rest

    def contains(self, points: Polyline, slack: float = 1e-6) -> bool:
        """Return whether points are in the area that is drawn on."""
        low, high = self.low - slack * (1 + 1j), self.high + slack * (1 + 1j)
        return bool(np.all((points.real >= low.real) & (points.real <= high.real)
                           & (points.imag >= low.imag) & (points.imag <= high.imag)))


class Placement(NamedTuple):
    """How a drawing comes on the wall.

    Attributes
    ----------
    affine : Affine
        From pixels of the drawing to mm on the wall: it is scaled and shifted.
    low, high : complex
        Upper left and lower right corners of the drawing there.
    """

    affine: Affine
    low: complex
    high: complex

    @property
    def scale(self) -> float:
        """Millimetres of the wall for one of the drawing."""
        return abs(self.affine.x) / MM_PER_PX


def place(low: complex, high: complex, wall: Wall, *, width: float | None = None,
          scale: float | None = None, at: complex | None = None) -> Placement:
    """Find the place of a drawing, given its corners in pixels. Its proportions are kept.

    Parameters
    ----------
    low, high : complex
        Its upper left and lower right corners.
    wall : Wall
        Where it comes.
    width : float, optional
        Its width on the wall in mm.
    scale : float, optional
        Millimetres of the wall for one of the drawing, if no width is given. If neither is, it
        becomes as large as the area allows.
    at : complex, optional
        Its upper left corner on the wall: else it is in the middle of the area.

    Raises
    ------
    UserError
        If it does not fit.
    """
    size, room = high - low, wall.high - (wall.low if at is None else at)
    if width is not None:
        if size.real < LEAST_PX:
            raise UserError("the drawing has no width that could be scaled to --width")
        factor = width / size.real
    elif scale is not None:
        factor = scale * MM_PER_PX
    else:
        factor = min((have / need for have, need in ((room.real, size.real), (room.imag, size.imag))
                      if need > LEAST_PX), default=1.0)
    start = at if at is not None else (wall.low + wall.high - size * factor) / 2
    placed = Placement(Affine(factor, 1j * factor, start - low * factor), start,
                       start + size * factor)
    if factor <= 0 or not wall.contains(np.array([placed.low, placed.high])):
        raise UserError(
            f"the drawing would be {size.real * factor:.1f} x {size.imag * factor:.1f} mm from "
            f"{_point(placed.low)} on, beyond the area from {_point(wall.low)} to "
            f"{_point(wall.high)}; see --width, --at, --margin, --top")
    return placed


class Part(NamedTuple):
    """What one pen draws.

    Attributes
    ----------
    name : str
        The layer, or the colour.
    colour : str
        That of most of its shapes, such as ``#ff0000``.
    lines : list of array of complex
        Places on the wall, in mm: each is drawn with the pen down.
    """

    name: str
    colour: str
    lines: list[Polyline]


def flatten(drawing: Drawing, placement: Placement, tolerance: float, pens: str) -> list[Part]:
    """Return what each pen draws, on the wall, with chords that are so close to the curves, in mm.

    Parameters
    ----------
    drawing : Drawing
        What is drawn.
    placement : Placement
        How it comes on the wall.
    tolerance : float
        How far a chord may be from its curve, in mm.
    pens : str
        ``layer``, ``colour``, or ``one`` for all.
    """
    parts: dict[str, list[Shape]] = {}
    for shape in drawing.shapes:
        name = {"layer": shape.layer or "no layer", "colour": shape.colour}.get(pens, "all")
        parts.setdefault(name, []).append(shape)
    return [Part(name, _most([shape.colour for shape in shapes]), [
        _chords(outline, placement, tolerance) for shape in shapes for outline in shape.outlines])
        for name, shapes in parts.items()]


def _chords(outline: Sequence, placement: Placement, tolerance: float) -> Polyline:
    """Return the points of an outline; its last is its first, bit for bit, where it is closed."""
    pieces, last = [], inf
    for curve in outline:
        points = curve.moved(placement.affine).chords(tolerance)
        pieces.append(points[1:] if abs(points[0] - last) < 1e-6 else points)
        last = points[-1]
    points = np.concatenate(pieces)
    if len(points) > 2 and abs(points[0] - points[-1]) < 1e-6:
        points[-1] = points[0]
    return points


def _most(names: Sequence[str]) -> str:
    return max(dict.fromkeys(names), key=names.count)


def _point(place: complex) -> str:
    return f"{place.real:g},{place.imag:g}"
