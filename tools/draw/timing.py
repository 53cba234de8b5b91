"""How long a drawing takes: speed along the path with look-ahead, as the machine plans it."""

from collections.abc import Sequence
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

from tb.models.plan import junctions

from .curves import Polyline
from .wall import Part

__all__ = ["Speeds", "duration_of", "seconds"]


class Speeds(NamedTuple):
    """What the plotter can do.

    Attributes
    ----------
    feed, rapid : float
        Speed with the pen down, and up, in mm/min.
    acceleration : float
        Along the path, in mm/s².
    deviation : float
        Junction deviation, in mm: how far a corner may be cut off, if it were rounded.
    dwell : float
        Seconds that the pen takes to move.
    """

    feed: float
    rapid: float
    acceleration: float
    deviation: float = 0.01
    dwell: float = 0.0


def seconds(parts: Sequence[Part], rest: complex, speeds: Speeds) -> tuple[float, float]:
    """Return how long the pen is down, and up, without pauses between pens.

    The pen stands where it is put down or raised. Blocks are planned back from the end of a line,
    by the model of the machine's own planner; there acceleration is that of each axis, here it is
    one number, so this is an estimate.
    """
    down = up = 0.0
    for part in parts:
        at = rest
        for line in part.lines:
            up += duration_of([at, line[0]], speeds.rapid, speeds) + 2 * speeds.dwell
            down += duration_of(line, speeds.feed, speeds)
            at = complex(line[-1])
        up += duration_of([at, rest], speeds.rapid, speeds)
    return down, up


def duration_of(line: Sequence[complex] | Polyline, rate: float, speeds: Speeds) -> float:
    """Return how long a line takes from rest to rest, at up to so many mm/min."""
    moves = [complex(b) - complex(a) for a, b in pairwise(line) if a != b]
    if not moves:
        return 0.0
    nominal = (rate / 60) ** 2
    limits = [0.0, *(min(nominal, _corner(a, b, speeds)) for a, b in pairwise(moves))]
    gains = [2 * speeds.acceleration * abs(move) for move in moves]
    squares = _junctions(limits, gains)
    return sum(_time(abs(move), enters, leaves, nominal, speeds.acceleration)
               for move, (enters, leaves) in zip(moves, pairwise(squares), strict=True))


def _junctions(limits: Sequence[float], gains: Sequence[float]) -> Sequence[float]:
    """Return the square of the speed at each junction; the model takes any numbers."""
    return junctions(list(zip(limits, gains, strict=True)))  # type: ignore[arg-type]  # floats


def _corner(a: complex, b: complex, speeds: Speeds) -> float:
    """Return the square of the speed at a corner, by junction deviation."""
    cosine = -(a * b.conjugate()).real / (abs(a) * abs(b))
    sine = sqrt(max(0.0, (1 - cosine) / 2))  # of half the angle between the lines
    return float("inf") if sine > 1 - 1e-9 else speeds.acceleration * speeds.deviation * sine / (
        1 - sine)


def _time(length: float, enters: float, leaves: float, nominal: float, acceleration: float
          ) -> float:
    """Return the time of a move whose speed is a trapezoid, or a triangle."""
    top = min(nominal, length * acceleration + (enters + leaves) / 2)
    top = max(top, enters, leaves)
    ramps = (2 * top - enters - leaves) / (2 * acceleration)
    change = (2 * sqrt(top) - sqrt(enters) - sqrt(leaves)) / acceleration
    return change + max(0.0, length - ramps) / sqrt(top)
