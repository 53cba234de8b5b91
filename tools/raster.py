"""Operations on the pixels of a picture, as arrays."""

from fractions import Fraction

import numpy as np

__all__ = ["otsu", "outlined", "thinned"]


def otsu(histogram: np.ndarray) -> int:
    """Find the threshold that best parts a picture in two (Otsu, 1979).

    Parameters
    ----------
    histogram : array of int, shape (256,)
        How many pixels have each grey.

    Returns
    -------
    int
        The last grey of the dark part: the variance between dark and light is the highest there. Of
        equally good ones in a row, the middle; 127 if all pixels are alike.
    """
    counts = [int(count) for count in histogram]
    total, mass = sum(counts), sum(grey * count for grey, count in enumerate(counts))
    below = mass_below = 0
    best, first, last = Fraction(0), 127, 127
    # In whole numbers: a tie is a tie on every machine.
    for grey, count in enumerate(counts):
        below += count
        mass_below += grey * count
        if not 0 < below < total:
            continue
        between = Fraction((mass * below - mass_below * total) ** 2, below * (total - below))
        if between > best:
            best, first, last = between, grey, grey
        elif between == best and last == grey - 1:
            last = grey
    return (first + last) // 2


def outlined(pixels: np.ndarray) -> np.ndarray:
    """Keep the edge of each figure.

    Parameters
    ----------
    pixels : array of bool, shape (rows, columns)
        The figures.

    Returns
    -------
    array of bool
        The set pixels with a clear one above, below, left or right. Outside, all is clear.
    """
    above, right, below, left = _neighbours(pixels)[::2]
    return pixels & ~(above & right & below & left)


def thinned(pixels: np.ndarray) -> np.ndarray:
    """Reduce each figure to lines one pixel wide (Guo and Hall, 1989).

    Parameters
    ----------
    pixels : array of bool, shape (rows, columns)
        The figures.

    Returns
    -------
    array of bool
        A part of the set pixels. Figures (8-connected) and holes (4-connected) stay as many as they
        were: no line breaks, and none vanishes.
    """
    pixels = pixels.copy()
    changed = True
    while changed:
        changed = False
        # The two half-steps take from opposite sides, so that the line stays in the middle.
        for half in (0, 4):
            n, ne, e, se, s, sw, w, nw = np.roll(_neighbours(pixels), -half, axis=0)
            crossings = (
                (~n & (ne | e)).astype(np.uint8)
                + (~e & (se | s))
                + (~s & (sw | w))
                + (~w & (nw | n))
            )
            one = (nw | n).astype(np.uint8) + (ne | e) + (se | s) + (sw | w)
            two = (n | ne).astype(np.uint8) + (e | se) + (s | sw) + (w | nw)
            around = np.minimum(one, two)
            inner = (n | ne | ~se) & e
            gone = pixels & (crossings == 1) & (around >= 2) & (around <= 3) & ~inner
            if gone.any():
                pixels &= ~gone
                changed = True
    return pixels


def _neighbours(pixels: np.ndarray) -> np.ndarray:
    """Return the eight pictures shifted by one pixel: from the one above on, clockwise."""
    rows, columns = pixels.shape
    padded = np.pad(pixels, 1)
    places = [(0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0)]
    return np.stack([padded[r : r + rows, c : c + columns] for r, c in places])
