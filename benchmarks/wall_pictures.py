"""Pictures of a wall: how far the pen is from its lines, and straight lines beside bowed ones."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tools.canvas import WIDTH, Canvas, colour_of, draw_axes, draw_legend
from tools.picture import CUT

from .wall_path import Point, Wall
from .wall_sums import CELL, bowed

__all__ = ["draw_lines", "draw_map"]

LEFT, TOP, RIGHT, BELOW = 64, 92, 110, 48
"""Room beside the wall."""

LEAST, MOST = 0.02, 0.5
"""Mm, of the colours."""

STRAIGHT, BOWED, ROPE = (31, 119, 180), (225, 80, 40), (150, 150, 150)

INSET, APART = 100, 392
"""Mm from the edges of the wall to the lines, and between them."""


class _Picture:
    """A wall to draw on, in mm, y down."""

    def __init__(self, place: Wall, title: str, facts: Sequence[str]) -> None:
        self._per_mm = (WIDTH - LEFT - RIGHT) / place.width
        self.box = (LEFT, TOP, WIDTH - RIGHT, TOP + round(place.height * self._per_mm))
        self.canvas = Canvas(self.box[3] + BELOW)
        self.canvas.text(LEFT, 24, title, size=20)
        for number, text in enumerate(facts):
            self.canvas.text(LEFT, 48 + 20 * number, text)
        self._width, self._height = place.width, place.height

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return a place in pixels."""
        return LEFT + x * self._per_mm, TOP + y * self._per_mm

    def axes(self) -> None:
        draw_axes(self.canvas, self.box, (0, self._width), (self._height, 0), "x, mm", "")
        self.canvas.text(LEFT - 8, self.box[3] + 29, "y, mm", anchor="rm", size=13)

    def pulleys(self, pen: tuple[float, float]) -> None:
        """Draw the pulleys, and the strings from which the pen hangs at rest."""
        for x in (0, self._width):
            self.canvas.line([self.at(x, 0), self.at(*pen)], ROPE)
            self.canvas.dot(*self.at(x, 0), CUT, 7)
        self.canvas.dot(*self.at(*pen), CUT, 4)

    def line(self, x: Sequence[float], y: Sequence[float], colour: tuple[int, int, int],
             width: float) -> None:
        self.canvas.line([self.at(*each) for each in zip(x, y, strict=True)], colour, width)


def draw_map(chart: NDArray[np.float64], place: Wall, facts: dict[str, Any]) -> Image.Image:
    """Draw how far the pen was from its lines at most, cell by cell.

    Parameters
    ----------
    chart : array
        As of :class:`Sums`; cells where no line came are left blank.
    place : Wall
        The wall.
    facts : dict
        The figures.

    Returns
    -------
    PIL.Image.Image
        The drawing, in colour, 1200 pixels wide.
    """
    bands = {each["from"]: each["straight"] for each in facts["bands"]}
    picture = _Picture(place, f"Pen from {facts['lines']} random lines, at most", [
        ", ".join(f"{most:.3f} mm from y = {band} mm on" for band, most in bands.items())])
    picture.axes()
    for row, column in np.argwhere(chart > 0).tolist():
        left, top = picture.at(column * CELL, row * CELL)
        right, bottom = picture.at(min((column + 1) * CELL, place.width),
                                   min((row + 1) * CELL, place.height))
        part = np.log(chart[row, column] / LEAST) / np.log(MOST / LEAST)
        picture.canvas.box((round(left), round(top), round(right), round(bottom)),
                           colour_of(float(part)))
    rest = place.settings.rest
    picture.pulleys((float(rest[0]), float(rest[1])))
    left, top, right, bottom = picture.box
    draw_legend(picture.canvas, (right + 24, top, right + 42, bottom), MOST, "mm", least=LEAST)
    return picture.canvas.done()


def lines(place: Wall) -> list[tuple[Point, Point]]:
    """Return lines of a grid, and its diagonals."""
    low, right, bottom = INSET * 2, place.width - INSET, place.height - INSET
    ends = [(INSET, y, right, y) for y in np.arange(low, bottom + 1, APART)]
    ends += [(x, low, x, bottom) for x in np.arange(INSET, right + 1, APART)]
    ends += [(INSET, low, right, bottom), (INSET, bottom, right, low)]
    return [((round(a * 1e6), round(b * 1e6)), (round(c * 1e6), round(d * 1e6)))
            for a, b, c, d in ends]


def draw_lines(place: Wall) -> Image.Image:
    """Draw a grid as the machine draws it, and bowed as the thesis does, over each other."""
    drawn, worst = [], [0.0, 0.0]
    for begin, end in lines(place):
        line = place.planned(begin, end)
        made = place.lengths(line)
        ways = place.pen(made.left, made.right), bowed(
            place, made.left[[0, -1]], made.right[[0, -1]])
        drawn += [(*(each[:: max(1, len(each) // 1000)].tolist() for each in way), colour)
                  for way, colour in zip(ways, (STRAIGHT, BOWED), strict=True)]
        worst = [max(most, float(line.off(*way).max())) for most, way in zip(
            worst, ways, strict=True)]
    picture = _Picture(place, "A grid and its diagonals, by the lengths of the strings", [
        f"blue: as it is drawn, {worst[0]:.3f} mm from the lines at most; red: each string at "
        f"constant speed, as in the thesis, {worst[1]:.0f} mm"])
    picture.axes()
    for x, y, colour in sorted(drawn, key=lambda each: each[2] == STRAIGHT):
        picture.line(x, y, colour, 2)
    rest = place.settings.rest
    picture.pulleys((float(rest[0]), float(rest[1])))
    return picture.canvas.done()
