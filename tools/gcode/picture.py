"""The picture of a job: its path coloured by speed, and speed and acceleration over time."""

from collections.abc import Callable, Sequence
from math import floor

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..canvas import SCALE, TEXT, WIDTH, Box, Canvas, colour_of, draw_axes, draw_legend
from .job import Job, Motion

__all__ = ["PATH", "draw_job"]

ASKED, PATH = (20, 20, 20), (31, 119, 180)

MARGIN, TITLE = 28, 20
LEFT, LEGEND, PLOT, GAP, CAPTION = 96, 120, 150, 56, 20
"""Room for numbers on the left, for the legend on the right; height of a plot, room below it, and
below the caption of the path."""

HIGHEST, LOWEST = 840, 320
"""Pixels of the path's picture, from top to bottom."""

LEAST_MM = 0.1, 0.001
"""Extent of X and Y that is drawn where these move less."""


def draw_job(job: Job, motion: Motion, title: str, facts: Sequence[str]) -> Image.Image:
    """Draw a job: its path from above, speed and acceleration, and Z if that moves.

    Parameters
    ----------
    job, motion : Job, Motion
        What is drawn.
    title : str
        What stands on top.
    facts : sequence of str
        Lines below it.

    Returns
    -------
    PIL.Image.Image
        The drawing, in colour, 1200 pixels wide.
    """
    low, high = _bounds(job, motion)
    across, up = (max(float(high[n] - low[n]), least) for n, least in enumerate(LEAST_MM))
    right = WIDTH - MARGIN - LEGEND
    room = right - LEFT
    height = min(max(round(room * up / across), LOWEST), HIGHEST)
    scale = min(room / across, height / up) * 0.94
    plots: list[tuple[str, NDArray]] = [
        ("speed, mm/min", motion.speed * 60), ("acceleration, mm/s^2", motion.acceleration)]
    if np.ptp(motion.place[:, 2]) > 0:
        plots.append(("Z, mm", motion.place[:, 2]))
    top = MARGIN + TITLE + len(facts) * (TEXT + 6) + 30
    bottom = top + height + GAP + CAPTION
    canvas = Canvas(bottom + len(plots) * (PLOT + GAP) + MARGIN // 2)
    canvas.text(MARGIN, MARGIN + TITLE // 2, title, size=TITLE)
    for number, text in enumerate(facts):
        canvas.text(MARGIN, MARGIN + TITLE + 16 + number * (TEXT + 6), text)

    middle = (low + high) / 2
    box = (LEFT, top, right, top + height)

    def placed(points: NDArray) -> NDArray:
        """Return where places in mm are in the picture: Y goes up."""
        return np.stack([(LEFT + right) / 2 + (points[:, 0] - middle[0]) * scale,
                         top + height / 2 - (points[:, 1] - middle[1]) * scale], axis=1)

    fastest = float(motion.speed.max())
    half = np.array([room, height]) / (2 * scale)
    draw_axes(canvas, box, (middle[0] - half[0], middle[0] + half[0]),
              (middle[1] - half[1], middle[1] + half[1]), "X, mm", "Y, mm")
    canvas.text(LEFT, box[3] + 29, "wide, coloured: what the pins did; thin: what was asked for, "
                "dashed where by G0", size=13)
    _path(canvas, job, motion, placed, fastest)
    draw_legend(canvas, (right + 24, top, right + 42, top + height), fastest * 60, "mm/min")
    for label, values in plots:
        box = (LEFT, bottom, right, bottom + PLOT)
        _plot(canvas, box, label, motion.time, values)
        bottom += PLOT + GAP
    return canvas.done()


def _bounds(job: Job, motion: Motion) -> tuple[NDArray, NDArray]:
    """Return the corners of what is drawn, in mm: the path that was asked for, and that made."""
    points = [motion.place.min(axis=0), motion.place.max(axis=0)]
    points += [np.array(point) for segment in job.segments for point in segment.points(0.1)]
    return np.min(points, axis=0), np.max(points, axis=0)


def _path(canvas: Canvas, job: Job, motion: Motion, placed: Callable[[NDArray], NDArray],
          fastest: float) -> None:
    """Draw what was made, in colours, and over it in thin lines what was asked for."""
    per_mm = job.per_mm
    rows = np.searchsorted(job.steps.clock / job.settings.clock - job.begin, motion.time, "right")
    steps = np.concatenate([np.zeros((1, 3)), job.steps.positions()])[rows]
    where = placed(steps / per_mm)
    pixel = np.floor(where * SCALE)
    kept = np.flatnonzero(np.concatenate([[True], (np.diff(pixel, axis=0) != 0).any(axis=1)]))
    points = [(x, y) for x, y in where[kept].tolist()]
    speeds = motion.speed[kept] / max(fastest, 1e-9)
    for before, (x, y), speed in zip(points, points[1:], speeds[1:].tolist(), strict=False):
        canvas.line([before, (x, y)], colour_of(speed), 5)
        canvas.dot(x, y, colour_of(speed), 2.5)
    for segment in job.segments:
        chords = placed(np.array(segment.points(0.01)))
        line = [(x, y) for x, y in chords.tolist()]
        if segment.rapid:
            _dashes(canvas, line)
        else:
            canvas.line(line, ASKED, 0.5)


def _dashes(canvas: Canvas, line: Sequence[tuple[float, float]], dash: float = 5) -> None:
    (x, y), (u, v) = line
    count = floor(max(abs(u - x), abs(v - y)) / dash)
    for n in range(0, count, 2):
        a, b = n / count, (n + 1) / count
        canvas.line([(x + (u - x) * a, y + (v - y) * a), (x + (u - x) * b, y + (v - y) * b)],
                    ASKED, 0.5)


def _plot(canvas: Canvas, box: Box, label: str, time: NDArray, values: NDArray) -> None:
    """Draw values over time: of those that share a column of pixels, the lowest and highest."""
    left, top, right, bottom = box
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    spare = (high - low or 1) * 0.06
    low, high = low - spare * (low < 0), high + spare
    draw_axes(canvas, box, (0, float(time[-1])), (low, high), "time, s", label)
    columns = np.floor(np.arange(len(values)) / len(values) * (right - left)).astype(int)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(columns) > 0]))
    least, most = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    last = values[np.append(starts[1:], len(values)) - 1]
    points = []
    for column, first, a, b, end in zip(
            columns[starts], values[starts], least, most, last, strict=True):
        points += [(left + column, bottom - (each - low) / (high - low) * (bottom - top))
                   for each in (first, a, b, end)]
    canvas.line(points, PATH, 1)
