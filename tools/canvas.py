"""What pictures with axes and a scale of colours are drawn of."""

from collections.abc import Sequence
from math import ceil, floor, log10

from PIL import Image, ImageDraw, ImageFont

from .picture import CUT, PAPER

__all__ = ["COLOURS", "SCALE", "TEXT", "WIDTH", "Box", "Canvas", "colour_of", "draw_axes",
           "draw_legend"]

GRID, FRAME = (226, 226, 226), (120, 120, 120)
COLOURS = ((43, 31, 115), (35, 115, 190), (30, 165, 135), (150, 200, 60), (250, 200, 50),
           (225, 80, 40))
"""From 0 to the highest value."""

WIDTH, TEXT, SMALL = 1200, 15, 13
"""Of pictures, and heights of letters, in pixels."""

SCALE = 2
"""Drawn so many times as large, and reduced: edges are smooth then."""

Box = tuple[int, int, int, int]
"""Left, top, right and bottom, in pixels."""


class Canvas:
    """What is drawn on: all numbers are in pixels of the picture.

    Parameters
    ----------
    height, width : int
        Of the picture.
    """

    def __init__(self, height: int, width: int = WIDTH) -> None:
        self.image = Image.new("RGB", (width * SCALE, height * SCALE), PAPER)
        self._draw = ImageDraw.Draw(self.image)

    def text(self, x: float, y: float, text: str, *, anchor: str = "lm", size: int = TEXT,
             colour: tuple[int, int, int] = CUT) -> None:
        """Write a text; `anchor` is as Pillow has it."""
        self._draw.text((x * SCALE, y * SCALE), text, colour,
                        ImageFont.load_default(size * SCALE), anchor=anchor)

    def line(self, points: Sequence[tuple[float, float]], colour: tuple[int, int, int],
             width: float = 1) -> None:
        """Draw a line from point to point."""
        self._draw.line([(x * SCALE, y * SCALE) for x, y in points], colour,
                        max(1, round(width * SCALE)), joint="curve")

    def dot(self, x: float, y: float, colour: tuple[int, int, int], radius: float) -> None:
        """Draw a filled circle."""
        self._draw.ellipse(((x - radius) * SCALE, (y - radius) * SCALE, (x + radius) * SCALE,
                            (y + radius) * SCALE), colour)

    def box(self, box: Box, fill: tuple[int, int, int] | None = None,
            outline: tuple[int, int, int] | None = None) -> None:
        """Draw a rectangle."""
        left, top, right, bottom = (each * SCALE for each in box)
        self._draw.rectangle((left, top, right, bottom), fill, outline, SCALE)

    def done(self) -> Image.Image:
        """Return the picture."""
        return self.image.reduce(SCALE)


def draw_axes(canvas: Canvas, box: Box, across: tuple[float, float], up: tuple[float, float],
              below: str, beside: str) -> None:
    """Draw a grid with numbers, and what they are; what goes up may fall, as a y that goes down."""
    left, top, right, bottom = box
    for tick in _ticks(*across, max(2, (right - left) // 90)):
        x = left + (right - left) * (tick - across[0]) / (across[1] - across[0])
        canvas.line([(x, top), (x, bottom)], GRID)
        canvas.text(x, bottom + 12, f"{tick:g}", anchor="mm", size=SMALL)
    for tick in _ticks(min(up), max(up), max(2, (bottom - top) // 30)):
        y = bottom - (bottom - top) * (tick - up[0]) / (up[1] - up[0])
        canvas.line([(left, y), (right, y)], GRID)
        canvas.text(left - 8, y, f"{tick:g}", anchor="rm", size=SMALL)
    canvas.box(box, outline=FRAME)
    canvas.text(right, bottom + 29, below, anchor="rm", size=SMALL)
    canvas.text(left, top - 12, beside, size=SMALL)


def draw_legend(canvas: Canvas, box: Box, most: float, unit: str, *, least: float = 0) -> None:
    """Draw the scale of the colours, from 0 to `most`; from another `least` on by logarithms."""
    left, top, right, bottom = box
    for y in range(top, bottom):
        canvas.box((left, y, right, y + 1), colour_of((bottom - y) / (bottom - top)))
    for tick in _decades(least, most) if least else _ticks(0, most, 6):
        part = log10(tick / least) / log10(most / least) if least else tick / max(most, 1e-9)
        y = bottom - (bottom - top) * part
        canvas.line([(right, y), (right + 5, y)], CUT)
        canvas.text(right + 9, y, f"{tick:g}", size=SMALL)
    canvas.text(left - 4, top - 14, unit, size=SMALL)


def _decades(low: float, high: float) -> list[float]:
    """Return 1, 2, 5, 10, ... and their tenth parts, from low to high."""
    numbers = (digit * 10.0**power for power in range(floor(log10(low)), ceil(log10(high)) + 1)
               for digit in (1, 2, 5))
    return [each for each in numbers if low * 0.999 <= each <= high * 1.001]


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Return round numbers from low to high, up to about so many."""
    rough = max((high - low) / most, 1e-9)
    unit = 10.0 ** floor(log10(rough))
    step = next(unit * each for each in (1, 2, 5, 10) if unit * each >= rough * 0.999)
    first = ceil(low / step - 1e-9)
    return [round(n * step, 9) + 0.0 for n in range(first, floor(high / step + 1e-9) + 1)]


def colour_of(part: float) -> tuple[int, int, int]:
    """Return the colour of a value, as a part of the highest."""
    place = min(max(part, 0.0), 1.0) * (len(COLOURS) - 1)
    n = min(int(place), len(COLOURS) - 2)
    r, g, b = (round(a + (b - a) * (place - n))
               for a, b in zip(COLOURS[n], COLOURS[n + 1], strict=True))
    return r, g, b
