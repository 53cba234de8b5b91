"""How far lines that were drawn are from those that were asked for."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .curves import Polyline

__all__ = ["Comparison", "compare", "distances", "joined"]

CHUNK = 256
"""Points that are compared at once: they are near to each other, and to the same segments."""


@dataclass(frozen=True)
class Comparison:
    """What the pen drew, compared with what it was asked to.

    Attributes
    ----------
    asked, drawn : int
        Numbers of lines.
    worst : float
        How far a place of the pen was from its line, or a point of a line from what was drawn of
        it, or an end from an end, at most, in mm.
    line : int
        In which line that was, counted from 1; 0 if there was none.
    where : complex
        Where on the wall.
    limit : float
        How far off it may be there, in mm.
    beyond : float
        How much more than that it was anywhere, in mm, at most; not above 0 if all is right.
    """

    asked: int
    drawn: int
    worst: float
    line: int
    where: complex
    limit: float
    beyond: float

    @property
    def right(self) -> bool:
        """Whether each line was drawn where it was asked for, and no other."""
        return self.asked == self.drawn and self.beyond <= 0


def compare(asked: Sequence[Polyline], drawn: Sequence[Polyline],
            limit: Callable[[Polyline], NDArray[np.float64]],
            progress: Callable[[int], None] = lambda done: None) -> Comparison:
    """Compare lines in their order.

    Parameters
    ----------
    asked : sequence of array of complex
        Each is drawn with the pen down, from its first point to its last.
    drawn : sequence of array of complex
        Where the pen was while it was down, a line for each time.
    limit : callable
        Gives how far off it may be at places, in mm.
    progress : callable
        Called with 1 for each line.
    """
    worst, number, where, beyond = 0.0, 0, 0j, -np.inf
    for count, (line, path) in enumerate(zip(asked, drawn, strict=False), 1):
        # Ends also: a line that is drawn from its end to its begin has all of its points.
        places = np.concatenate([path, line, line[[0, -1]]])
        off = np.concatenate([distances(path, line), distances(line, path),
                              np.abs(path[[0, -1]] - line[[0, -1]])])
        beyond = max(beyond, float((off - limit(places)).max()))
        most = int(off.argmax())
        if off[most] > worst or not number:
            worst, number, where = float(off[most]), count, complex(places[most])
        progress(1)
    allowed = float(limit(np.array([where]))[0]) if number else 0.0
    return Comparison(len(asked), len(drawn), worst, number, where, allowed, beyond)


def joined(lines: Sequence[Polyline], counts: Sequence[int]) -> list[Polyline]:
    """Join lines that were drawn, each where the one before ended, while they are too many.

    Parameters
    ----------
    lines : sequence of array of complex
        What was drawn.
    counts : sequence of int
        Of how many lines each may be made: more are not joined.
    """
    made: list[Polyline] = []
    left, spare = [*lines], len(lines) - len(counts)
    for count in counts:
        parts = left[:1]
        while (spare > 0 and 0 < len(parts) < min(count, len(left))
               and parts[-1][-1] == left[len(parts)][0]):
            parts.append(left[len(parts)])
            spare -= 1
        del left[:len(parts)]
        if parts:
            made.append(np.concatenate(parts))
    return made + left


def distances(points: Polyline, line: Polyline) -> NDArray[np.float64]:
    """Return the distance of each point from a line of straight segments."""
    starts = line[:-1] if len(line) > 1 else line
    ends = line[1:] if len(line) > 1 else line
    found = []
    for first in range(0, len(points), CHUNK):
        chunk = points[first:first + CHUNK]
        middle = (complex(chunk.real.min(), chunk.imag.min())
                  + complex(chunk.real.max(), chunk.imag.max())) / 2
        radius = float(np.abs(chunk - middle).max())
        # No segment is the nearest to a point of these that is so much farther from their middle.
        off = _from(np.array([middle]), starts, ends)[0]
        near = off <= off.min() + 2 * radius + 1e-9
        found.append(_from(chunk, starts[near], ends[near]).min(axis=1))
    return np.concatenate(found) if found else np.zeros(0)


def _from(points: Polyline, starts: Polyline, ends: Polyline) -> NDArray[np.float64]:
    """Return the distance of each point from each segment."""
    ways = ends - starts
    squares = np.abs(ways) ** 2
    to = points[:, None] - starts
    along = (to * ways.conj()).real / np.where(squares > 0, squares, 1)
    return np.abs(to - np.clip(along, 0, 1) * ways)
