"""Drawings for tests, and how far lines are from each other."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["INKSCAPE", "distances", "svg", "write"]

INKSCAPE = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'


def svg(body: str, attributes: str = 'width="100" height="100"') -> str:
    """Return a document."""
    return (f'<svg xmlns="http://www.w3.org/2000/svg" {INKSCAPE} '
            f'xmlns:xlink="http://www.w3.org/1999/xlink" {attributes}>{body}</svg>')


def write(folder: Path, body: str, attributes: str = 'width="100" height="100"') -> Path:
    """Write a document into a folder."""
    path = folder / "drawing.svg"
    path.write_text(svg(body, attributes), encoding="utf-8")
    return path


def distances(points: NDArray, line: NDArray) -> NDArray:
    """Return how far each point is from a polyline."""
    found = np.full(len(points), np.inf)
    for a, b in zip(line, line[1:], strict=False):
        square = abs(b - a) ** 2
        along = np.clip(((points - a) * (b - a).conjugate()).real / square, 0, 1) if square else 0
        found = np.minimum(found, np.abs(points - a - along * (b - a)))
    return found
