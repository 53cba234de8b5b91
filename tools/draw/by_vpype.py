"""Lines merged, simplified and sorted by vpype."""

from collections.abc import Sequence

import numpy as np
import vpype
import vpype_cli

from .curves import Polyline

__all__ = ["merge_and_sort"]


def merge_and_sort(lines: Sequence[Polyline], tolerance: float) -> list[Polyline]:
    """Return lines joined where ends are within the tolerance, simplified by it, and sorted.

    Its unit is a pixel, and a millimetre here: it need not know.
    """
    document = vpype.Document()
    document.add(vpype.LineCollection([line for line in lines if len(line) > 1]), 1)
    done = vpype_cli.execute(
        f"linemerge --tolerance {tolerance:.9f} linesimplify --tolerance {tolerance:.9f} linesort",
        document)
    return [np.asarray(line) for layer in done.layers.values() for line in layer]
