# amaranth: UnusedElaboratable=no

"""The spiral: everything, once, the nearest first."""

import pytest

from fresa.motion import SpiralWalk
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ["row", "column", "number", "inside", "near"]


def walk(rows, columns, centre):
    """Go to a pixel by way of spirals, begin one there, and list what it meets inside."""
    met = []
    with AmaranthEngine(component("spiral", SpiralWalk(rows=rows, columns=columns))) as engine:
        engine.set(home=1)
        engine.run(1)
        engine.set(home=0, centre=1)
        engine.run(1)
        engine.set(centre=0, advance=1)
        for _ in range((2 * max(rows, columns) + 1) ** 2):
            row, column, _, inside, _ = engine.get(*OUTPUTS)
            if inside and (row, column) == centre:
                break
            engine.run(1)
        else:
            raise AssertionError(f"{centre} is never met")
        engine.set(centre=1, advance=0)
        engine.run(1)
        engine.set(centre=0, advance=1)
        for _ in range((2 * max(rows, columns)) ** 2):
            row, column, number, inside, near = engine.get(*OUTPUTS)
            if inside:
                met.append((row, column, number, near))
            engine.run(1)
    return met


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 5), (5, 1), (4, 4), (3, 7), (8, 5)])
def test_meets_every_pixel_once_nearest_first(rows, columns):
    for centre in {(0, 0), (rows - 1, columns - 1), (rows // 2, columns // 2), (0, columns - 1)}:
        met = walk(rows, columns, centre)
        assert sorted(met)[0][:2] == (0, 0)
        assert len(met) == rows * columns == len(set(met))
        away = []
        for row, column, number, near in met:
            assert 0 <= row < rows and 0 <= column < columns
            assert number == row * columns + column
            away.append(max(abs(row - centre[0]), abs(column - centre[1])))
            assert near == (away[-1] <= 1)
        assert away == sorted(away)
