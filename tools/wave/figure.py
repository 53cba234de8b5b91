"""A timing diagram: rows of signals over an axis of time or of clocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, log10

import numpy as np
from numpy.typing import NDArray

from .lanes import GAP, Frame, Row, draw_row, short
from .scene import CHARACTER, Scene

__all__ = ["Axis", "Row", "figure"]

MARGIN = 14.0
"""Space around the figure, in pixels."""

TITLE, SCALE = 26.0, 30.0
"""Heights of the title and of the axis."""

LONGEST = 34
"""Most characters of a name; longer names are shortened."""

TICK = 80.0
"""Least pixels from one number of the axis to the next; clocks are half as far apart."""

FINEST = 7.0
"""Least pixels between two clocks for a line at each."""


@dataclass(frozen=True)
class Axis:
    """The scale below the rows.

    Attributes
    ----------
    unit : str
        Its unit.
    ticks : float
        Ticks of the wave in a unit of time; ignored if there are marks.
    marks : array of int64, optional
        Times of clocks, which are drawn and numbered, in ticks.
    first : int
        Number of the first mark.
    """

    unit: str
    ticks: float = 1.0
    marks: NDArray[np.int64] | None = None
    first: int = 1


def figure(
    rows: Sequence[Row], start: int, end: int, axis: Axis, *, width: float = 900, title: str = "",
    about: str = "",
) -> Scene:
    """Draw a timing diagram.

    Parameters
    ----------
    rows : sequence of Row
        The rows, from top to bottom.
    start, end : int
        The interval to draw, in ticks.
    axis : Axis
        The scale below the rows.
    width : float
        Width of the figure in pixels, with the names.
    title : str
        Text above the figure, if any.
    about : str
        Text for readers who cannot see it.
    """
    names = min(max((len(row.name) for row in rows), default=0), LONGEST) * CHARACTER
    left, right = MARGIN + names + GAP, width - MARGIN - 6
    top = MARGIN + (TITLE if title else 0)
    bottom = top + sum(row.height for row in rows)
    scene = Scene(width, bottom + SCALE + MARGIN / 2, title or "Timing diagram", about)
    frame = Frame(left, max(right, left + 50), start, max(end, start + 1))
    if title:
        scene.text("title", MARGIN, MARGIN + 8, title)
    _draw_axis(scene, frame, axis, top, bottom)
    for row in rows:
        middle = top + row.height / 2
        if row.trace is None:
            scene.text("group", MARGIN, middle + 4, short(row.name, LONGEST))
        else:
            scene.text("name", MARGIN, middle, short(row.name, LONGEST, tail=True))
            draw_row(scene, frame, row, middle)
        top += row.height
    return scene


def _draw_axis(scene: Scene, frame: Frame, axis: Axis, top: float, bottom: float) -> None:
    if axis.marks is None:
        step = _nice(TICK * (frame.end - frame.start) / (frame.right - frame.left) / axis.ticks)
        first = int(np.ceil(frame.start / axis.ticks / step - 1e-9))
        last = int(np.floor(frame.end / axis.ticks / step + 1e-9))
        numbered = [(frame.x(n * step * axis.ticks), f"{n * step:.10g}")
                    for n in range(first, last + 1)]
    else:
        inside = (axis.marks >= frame.start) & (axis.marks <= frame.end)
        places = [frame.x(time) for time in axis.marks[inside].tolist()]
        clock = axis.first + int(np.searchsorted(axis.marks, frame.start))
        apart = (frame.right - frame.left) / max(len(places), 1)
        step = max(1, round(_nice(TICK / 2 / apart)))
        if apart >= FINEST:
            for x in places:
                scene.line("grid", [(x, top), (x, bottom)])
        numbered = [(x, str(n)) for n, x in enumerate(places, start=clock) if n % step == 0]
    scene.line("axis", [(frame.left, bottom + 3), (frame.right, bottom + 3)])
    scene.text("note", MARGIN, bottom + 16, axis.unit)
    for x, text in numbered:
        scene.line("grid", [(x, top), (x, bottom)])
        scene.line("axis", [(x, bottom + 3), (x, bottom + 7)])
        scene.text("note", x, bottom + 16, text, "middle")


def _nice(least: float) -> float:
    """Return the smallest of 1, 2 and 5 times a power of ten that is not less."""
    power = 10.0 ** floor(log10(least)) if least > 0 else 1.0
    return next(n * power for n in (1, 2, 5, 10) if n * power >= least * (1 - 1e-9))
