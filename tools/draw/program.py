"""Drawings as programs: G-code, and the plotter's own commands of its first firmware."""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..console import UserError
from .curves import Polyline
from .order import simplified
from .wall import Part, Wall

__all__ = ["MOST_DWELL_S", "MOST_MM", "MOST_SPEED", "Section", "gcode", "number", "original",
           "point_command", "sections", "segments", "strokes"]

DECIMALS = 2
"""Of a coordinate in G-code: a hundredth of a millimetre is a quarter of a step."""

MOST_MM, MOST_SPEED, MOST_DWELL_S = 1e5, 1e6, 10.0
"""Of a length, of a speed in mm/min, and of what a pen takes to go down or up."""

MOST_ORIGINAL = 9999
"""Millimetres that the four digits of a coordinate can say."""

DOT_S = 0.1
"""Seconds that the pen is down for a dot at least: of ``M3`` and ``M5`` without a movement or a
dwell between them the machine makes nothing, if it still moves when they come."""

ORIGINAL_TOLERANCE = 0.5
"""Of its whole millimetres."""


class Section(NamedTuple):
    """What is sent without a pause: a pen's part.

    Attributes
    ----------
    pen : str
        What to put in before it; the name of the part.
    lines : list of str
        Of G-code.
    """

    pen: str
    lines: list[str]


def sections(parts: Sequence[Part], wall: Wall, feed: float, dwell: float = 0.0) -> list[Section]:
    """Return the G-code of each pen. Each begins and ends at the place of rest, with the pen up.

    Parameters
    ----------
    parts : sequence of Part
        What each pen draws, in the order of its lines.
    wall : Wall
        For its height: Y goes up from the lower edge.
    feed : float
        Speed with the pen down, in mm/min.
    dwell : float
        Seconds that the pen takes to move.
    """
    pause = [f"G4 P{number(dwell, 3)}"] if dwell else []
    made = []
    for index, part in enumerate(parts):
        lines = ["G21 G90 G94 G54", "M5"] if not index else []
        lines.append(f"({_comment(f'pen {index + 1} of {len(parts)}: {part.name}')})")
        for line in part.lines:
            start, *moves = _moves([_words(place, wall) for place in line], feed)
            down = pause if moves else [f"G4 P{number(max(dwell, DOT_S), 3)}"]
            lines += [start, "M3 S1000", *down, *moves, "M5", *pause]
        lines.append(f"G0 {' '.join(_words(wall.resting, wall))}")
        made.append(Section(part.name, lines))
    made[-1].lines.append("M2")
    return made


def strokes(part: Part, wall: Wall, dwell: float = 0.0) -> list[list[Polyline]]:
    """Return the lines of a part, those together between which the pen may not be raised.

    It may not where a line begins at the end of the one before: between ``M5`` and ``M3`` there is
    neither a movement nor a dwell.
    """
    found: list[list[Polyline]] = []
    for line in part.lines:
        if found and not dwell and _words(found[-1][-1][-1], wall) == _words(line[0], wall):
            found[-1].append(line)
        else:
            found.append([line])
    return found


def _moves(points: Sequence[tuple[str, str]], feed: float) -> Iterator[str]:
    """Yield the line that leads to the first point, and those that draw: words that change.

    A dot has none that draws.
    """
    points = [points[0], *(b for a, b in pairwise(points) if a != b)]
    yield f"G0 {' '.join(points[0])}"
    for index, (a, b) in enumerate(pairwise(points)):
        words = " ".join(new for new, old in zip(b, a, strict=True) if new != old)
        yield words if index else f"G1 {words} F{number(feed)}"


def gcode(parts: Sequence[Part], wall: Wall, feed: float, dwell: float = 0.0) -> str:
    """Return a whole program of G-code; between pens it waits for a start (M0)."""
    text = []
    for index, section in enumerate(sections(parts, wall, feed, dwell)):
        if index:
            text.append(f"M0 ({_comment(f'change to pen {index + 1}: {section.pen}')})")
        text += section.lines
    return "\n".join(text) + "\n"


def original(part: Part, wall: Wall) -> str:
    """Return the commands of the first firmware for one pen, in whole mm, y down.

    They have no word for another pen, so each pen has a list of its own.

    Raises
    ------
    UserError
        If four digits cannot say a coordinate.
    """
    if max(wall.width, wall.height) > MOST_ORIGINAL:
        raise UserError(f"--original has four digits for a coordinate: a wall of up to "
                        f"{MOST_ORIGINAL} mm")
    commands = [":P1", ":H"]
    for start, end in segments(part):
        commands += [point_command("I", start), point_command("F", end)]
    commands.append(point_command("I", wall.resting))
    return "\n".join(commands) + "\n"


def segments(part: Part) -> Iterator[tuple[complex, complex]]:
    """Yield the straight pieces that commands of the first firmware draw: their ends in whole mm.

    Of a dot both ends are the same.
    """
    for line in part.lines:
        whole = np.round(simplified(line, ORIGINAL_TOLERANCE).view(float)).view(complex)
        points = [complex(whole[0]), *(complex(b) for a, b in pairwise(whole) if a != b)]
        yield from pairwise(points if len(points) > 1 else points * 2)


def point_command(letter: str, place: complex) -> str:
    """Return a command of the first firmware, ``I`` or ``F``, for a place."""
    return f":{letter}{round(place.real):04d}{round(place.imag):04d}"


def _words(place: complex, wall: Wall) -> tuple[str, str]:
    return f"X{number(place.real)}", f"Y{number(wall.height - place.imag)}"


def number(value: float, decimals: int = DECIMALS) -> str:
    """Return a number as short as it can be."""
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text


def _comment(text: str) -> str:
    """Return what may be in a comment, on every machine: no brackets, and no real-time commands."""
    return re.sub(r"[^\w #.,:-]", "_", text, flags=re.ASCII)[:60]
