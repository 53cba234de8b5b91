"""The picture of a cut: what was asked, what was milled, and the way through the air."""

from fractions import Fraction

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fresa.machines.mill import PIXEL_STEPS, TOP_SPEED
from tb.milling import Cut

from .picture import BLANK, CUT, FRAME, PAPER

__all__ = ["draw_cut", "duration", "strokes"]

AIR = (31, 119, 180)
MISSED = (214, 39, 40)
IN_ERROR = (227, 38, 200)

MARGIN, TEXT = 24, 16


def duration(seconds: float) -> str:
    """Return a time in words: 48 s, 12 min, 3 h 05 min."""
    if seconds < 99.5:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02} min"


def strokes(number: object) -> str:
    """Count strokes in words."""
    return f"{number} stroke" if number == 1 else f"{number} strokes"


def draw_cut(cut: Cut, step_rate: Fraction = TOP_SPEED) -> Image.Image:
    """Draw what was asked on the left, what was milled on the right.

    Pixels that were milled are dark, missed ones red, ones milled in error magenta; the tool's way
    through the air is a thin blue line.

    Parameters
    ----------
    cut : Cut
        The job, done.
    step_rate : number
        Steps a second of the real machine, for the time that is written below.

    Returns
    -------
    PIL.Image.Image
        The drawing, in colour, some 1200 pixels wide.
    """
    rows, columns = cut.target.shape
    scale = max(1, min(24, 560 // max(rows, columns)))
    height, width = rows * scale, columns * scale
    font = ImageFont.load_default(TEXT)
    facts = cut.facts()
    captions = (
        f"asked: {facts['pixels_asked']} pixels",
        f"milled: {facts['pixels_cut']}, missed {facts['pixels_missed']}, "
        f"in error {facts['cut_in_error']}",
    )
    legend = (f"blue: {facts['air_mm']:.0f} mm through the air, {strokes(facts['strokes'])}; "
              f"{duration(cut.job_seconds(step_rate))} on the machine")

    pane = max(width, *(round(font.getlength(caption)) for caption in captions))
    wide = max(2 * pane + MARGIN, round(font.getlength(legend)))
    canvas = Image.new("RGB", (wide + 2 * MARGIN, height + 3 * MARGIN + 3 * TEXT), PAPER)
    draw = ImageDraw.Draw(canvas)
    lefts = (MARGIN, 2 * MARGIN + pane)
    top = 2 * MARGIN + TEXT
    for left, caption in zip(lefts, captions, strict=True):
        draw.text((left, MARGIN + TEXT // 2), caption, CUT, font, anchor="lm")
        draw.rectangle((left - 1, top - 1, left + width, top + height), BLANK, FRAME)

    def paint(left: int, pixels: np.ndarray, colour: tuple[int, int, int]) -> None:
        mask = Image.fromarray(np.where(pixels, 255, 0).astype(np.uint8))
        canvas.paste(colour, (left, top), mask.resize((width, height), Image.Resampling.NEAREST))

    paint(lefts[0], cut.target, CUT)
    milled = cut.plant.cut
    paint(lefts[1], milled & cut.target, CUT)
    paint(lefts[1], cut.target & ~milled, MISSED)
    paint(lefts[1], milled & ~cut.target, IN_ERROR)

    def place(x: int, y: int) -> tuple[float, float]:
        return (lefts[1] + (y / PIXEL_STEPS + 0.5) * scale, top + (x / PIXEL_STEPS + 0.5) * scale)

    for line in cut.plant.path:
        if not line.cut:
            points = [place(int(x), int(y)) for x, y in line.points]
            draw.line(points, AIR, width=max(1, scale // 6))
    for wrong in cut.plant.wrong:
        x, y = place(wrong.x, wrong.y)
        draw.ellipse((x - 2, y - 2, x + 2, y + 2), IN_ERROR)

    draw.text((MARGIN, top + height + MARGIN // 2 + TEXT), legend, CUT, font, anchor="lm")
    return canvas
