"""The picture of a wall: pulleys, what is drawn in the colours of the pens, and the travel."""

import unicodedata
from collections.abc import Iterator, Sequence
from math import ceil, hypot

import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from ..picture import CUT, PAPER
from .curves import Polyline
from .wall import Part, Wall

__all__ = ["draw_wall", "pen_colours", "travels"]

Colour = tuple[int, int, int]

WALL, EDGE, AREA, TRAVEL, ASKED, WORST = (
    (250, 248, 244), (160, 150, 135), (222, 216, 206), (130, 160, 195), (60, 60, 66),
    (235, 120, 60))
PALETTE: tuple[Colour, ...] = (
    (31, 31, 36), (200, 50, 40), (30, 90, 180), (35, 140, 70), (150, 60, 160), (205, 120, 20),
    (20, 140, 150), (120, 80, 50))
"""Of pens that have no colours of their own."""

PIXELS, MARGIN, TEXT, TITLE, LINE = 1000, 36, 15, 20, 22
"""The longer side of the wall; the margin around it; sizes of text, and height of a line of it."""

LONGEST = 60
"""Characters of a name of a file or layer."""

LENS, LENS_MM = 240, 1.6
"""Side of the square below the wall that shows a place magnified, and at least how much of it."""

SCALE = 2
"""Drawn so many times as large, and reduced: edges are smooth then."""

DASH_PX = 6
PALEST = 200
"""Brightness above which a pen is drawn darker, to be seen on the wall."""


def pen_colours(parts: Sequence[Part]) -> list[Colour]:
    """Return a colour for each pen: its own, or of the palette where two have the same."""
    own = [part.colour for part in parts]
    if len(set(own)) < len(own):
        return [PALETTE[n % len(PALETTE)] for n in range(len(parts))]
    return [_visible(ImageColor.getrgb(each)[:3]) for each in own]


def _visible(colour: tuple[int, ...]) -> Colour:
    red, green, blue = colour
    bright = 0.3 * red + 0.59 * green + 0.11 * blue
    factor = min(1.0, PALEST / max(bright, 1))
    return round(red * factor), round(green * factor), round(blue * factor)


def travels(parts: Sequence[Part], rest: complex) -> Iterator[tuple[complex, complex]]:
    """Yield the ways with the pen up, as they come: from rest, from line to line, back to rest."""
    for part in parts:
        at = rest
        for line in part.lines:
            yield at, complex(line[0])
            at = complex(line[-1])
        yield at, rest


class _Canvas:
    """A wall that is drawn on, in mm, with texts that are so wide at most, in pixels."""

    def __init__(self, wall: Wall, lines_below: int, widest: int) -> None:
        self._per_mm = PIXELS / max(wall.width, wall.height)
        self.width, self.height = (round(each * self._per_mm) for each in (wall.width, wall.height))
        size = (max(self.width, widest) + 2 * MARGIN,
                self.height + 3 * MARGIN + TITLE + lines_below * LINE)
        self.image = Image.new("RGB", (size[0] * SCALE, size[1] * SCALE), PAPER)
        self.draw = ImageDraw.Draw(self.image)
        self.left, self.top = MARGIN, 2 * MARGIN + TITLE

    def at(self, place: complex) -> tuple[float, float]:
        """Return where a place on the wall is in the picture."""
        return ((self.left + place.real * self._per_mm) * SCALE,
                (self.top + place.imag * self._per_mm) * SCALE)

    def line(self, points: Sequence[complex] | Polyline, colour: Colour, width: float) -> None:
        """Draw a line through places; a dot, if they are one."""
        wide = max(1, round(width * SCALE))
        if len(points) < 2 or all(point == points[0] for point in points):
            x, y = self.at(complex(points[0]))
            self.draw.ellipse((x - wide, y - wide, x + wide, y + wide), colour)
            return
        self.draw.line([self.at(complex(point)) for point in points], colour, wide, joint="curve")

    def dashes(self, start: complex, end: complex, colour: Colour) -> None:
        """Draw a dashed line."""
        (x, y), (u, v) = self.at(start), self.at(end)
        count = ceil(hypot(u - x, v - y) / (DASH_PX * SCALE))
        for n in range(0, count, 2):
            a, b = n / count, min(1.0, (n + 1) / count)
            self.draw.line([x + (u - x) * a, y + (v - y) * a, x + (u - x) * b, y + (v - y) * b],
                           colour, SCALE)

    def box(self, low: complex, high: complex, fill: Colour | None, outline: Colour) -> None:
        """Draw a rectangle, given its corners on the wall."""
        self.draw.rectangle((*self.at(low), *self.at(high)), fill, outline, SCALE)

    def text(self, x: float, y: float, text: str, size: int = TEXT, colour: Colour = CUT) -> None:
        """Write, at pixels of the picture."""
        self.draw.text((x * SCALE, y * SCALE), text, colour,
                       ImageFont.load_default(size * SCALE), anchor="lm")


def draw_wall(parts: Sequence[Part], wall: Wall, title: str, facts: Sequence[str] = (),
              done: Sequence[Sequence[Polyline]] = (), worst: tuple[complex, float] | None = None
              ) -> Image.Image:
    """Draw a wall with what is on it.

    Parameters
    ----------
    parts : sequence of Part
        What each pen is asked to draw, in its colour.
    wall : Wall
        The wall.
    title : str
        What stands on top.
    facts : sequence of str
        Lines below the wall.
    done : sequence of sequence of array of complex
        What each pen has drawn, if that is known: in its colour, over thin lines of what it was
        asked to draw.
    worst : tuple of complex and float, optional
        A place that is also drawn magnified, and how far off the pen was there, in mm.

    Returns
    -------
    PIL.Image.Image
        The drawing, in colour.
    """
    title, facts = _plain(title), [_plain(text, len(text)) for text in facts]
    pens = [f"pen {number}: {_plain(part.name)}" for number, part in enumerate(parts, 1)]
    rows = len(facts) + len(pens)
    below = ceil(max(_width(text, TEXT) for text in [*facts, *pens])) + MARGIN
    canvas = _Canvas(wall, rows if worst is None else max(rows, LENS // LINE + 2), max(
        ceil(_width(title, TITLE)), below if worst is None else below + LENS))
    whole = complex(wall.width, wall.height)
    canvas.box(0, whole, WALL, EDGE)
    canvas.box(wall.low, wall.high, None, AREA)
    for corner in (0j, complex(wall.width)):
        canvas.line([corner, wall.resting], AREA, 1)
        canvas.line([corner], EDGE, 7)
    for start, end in travels(parts, wall.resting):
        canvas.dashes(start, end, TRAVEL)
    colours = pen_colours(parts)
    for part, colour in zip(parts, colours, strict=True):
        for line in part.lines:
            canvas.line(line, ASKED if done else colour, 1)
    for lines, colour in zip(done, colours, strict=False):
        for line in lines:
            canvas.line(line, colour, 1.5)
    canvas.line([wall.resting], TRAVEL, 4)
    if worst is not None:
        _magnify(canvas, parts, list(zip(done, colours, strict=False)), *worst)

    canvas.text(MARGIN, MARGIN, title, TITLE)
    y = canvas.top + canvas.height + MARGIN
    for pen, colour in zip(pens, colours, strict=True):
        canvas.draw.rectangle([MARGIN * SCALE, (y - 4) * SCALE, (MARGIN + 26) * SCALE,
                               (y + 4) * SCALE], colour)
        canvas.text(MARGIN + 36, y, pen)
        y += LINE
    for text in facts:
        canvas.text(MARGIN, y, text)
        y += LINE
    return canvas.image.reduce(SCALE)


def _magnify(canvas: _Canvas, parts: Sequence[Part],
             done: Sequence[tuple[Sequence[Polyline], Colour]], place: complex, off: float) -> None:
    """Mark a place, and draw what is there in a square at the lower right."""
    across = max(LENS_MM, 4 * off)
    side = LENS * SCALE
    square = Image.new("RGB", (side, side), WALL)
    draw = ImageDraw.Draw(square)

    def pixels(points: Sequence[complex] | Polyline) -> list[tuple[float, float]]:
        found = (np.asarray(points) - place) / across * side + side / 2 * (1 + 1j)
        return [(point.real, point.imag) for point in found.tolist()]

    for lines, colour in done:
        for line in lines:
            near = np.flatnonzero(np.abs(line - place) < across)
            for run in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1):
                if len(run) > 1:
                    draw.line(pixels(line[run]), colour, 2 * SCALE)
    for part in parts:
        for line in part.lines:
            if len(line) > 1:
                draw.line(pixels(line), ASKED, SCALE)
    draw.rectangle((0, 0, side - 1, side - 1), None, WORST, SCALE)
    x, y = canvas.at(place)
    ring = 7 * SCALE
    canvas.draw.ellipse((x - ring, y - ring, x + ring, y + ring), None, WORST, SCALE)
    left = canvas.image.width // SCALE - MARGIN - LENS
    top = canvas.top + canvas.height + MARGIN // 2
    canvas.image.paste(square, (left * SCALE, top * SCALE))
    canvas.text(left, top + LENS + LINE // 2, f"{across:.2g} mm, magnified")


def _plain(text: str, longest: int = LONGEST) -> str:
    """Return a text of the letters that Pillow's own font has, shortened."""
    found = "".join(each for each in unicodedata.normalize("NFKD", " ".join(text.split()))
                    if not unicodedata.combining(each)).encode("ascii", "replace").decode("ascii")
    return found if len(found) <= longest else f"{found[:longest - 3]}..."


def _width(text: str, size: int) -> float:
    """Return how wide a text is, in pixels."""
    return ImageFont.load_default(size).getlength(text)
