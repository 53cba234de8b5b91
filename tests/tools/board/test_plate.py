"""What is told of the tool's way, on walks worked out by hand."""

import numpy as np
import pytest

from fresa.machines.mill import PIXEL_STEPS, Z_TRAVEL
from tb.engines import Changes
from tb.plant import WORDS
from tools.board.messages import CORNER, PIXEL, Job
from tools.board.plate import COILS, Plate

PIXELS = np.array([[1, 1], [0, 1]], bool)
DOWN, UP = (0, 0, -1), (0, 0, 1)


def walk(*moves: tuple[tuple[int, int, int], int]) -> Changes:
    """Coil words of a machine that makes these steps, so many of each, one a clock."""
    steps = np.array([step for step, count in moves for _ in range(count)], np.int64)
    places = np.concatenate([np.zeros((1, 3), np.int64), np.cumsum(steps, axis=0)])
    words = np.array(WORDS)[places % 4]
    return Changes(np.arange(len(places)), dict(zip(COILS, words.T, strict=True)))


def part(changes: Changes, start: int, end: int) -> Changes:
    return Changes(changes.clock[start:end],
                   {name: values[start:end] for name, values in changes.values.items()})


WAY = walk((DOWN, Z_TRAVEL), ((0, 1, 0), PIXEL_STEPS), (UP, Z_TRAVEL), ((1, -1, 0), PIXEL_STEPS),
           ((0, -1, 0), 5), ((1, 0, -1), 7), ((1, 0, 0), 9))
CORNERS = [(0, 0, 0), (0, 128, 1), (128, 0, 0), (128, -5, 0), (135, -5, 1)]
TIP = (144, -5, 1)


class TestPath:
    @pytest.mark.parametrize("many", [1, 10, 997, 5000])
    def test_however_often_it_is_taken(self, many):
        """Corners of the plane; the way to one was cut if it was in the plate at either end."""
        cuts = np.linspace(1, len(WAY), many + 1, dtype=int)
        plate = Plate(Job(PIXELS, ""), part(WAY, 0, 1))
        path, cut, tip, anew = b"", b"", b"", []
        for start, end in zip([1, *cuts[:-1]], cuts, strict=True):
            plate.feed(part(WAY, start, end))
            fixed, tip, path_anew = plate.take_path()
            milled, cut_anew = plate.take_cut()
            path, cut = path + fixed, cut + milled
            anew.append((path_anew, cut_anew))
        assert np.frombuffer(path, CORNER).tolist() == CORNERS
        assert np.frombuffer(tip, CORNER).tolist() == [TIP]
        assert np.frombuffer(cut, PIXEL).tolist() == [0, 1]
        assert anew == [(True, True)] + [(False, False)] * many

    def test_up_out_of_the_plate_on_a_slope_was_cut(self):
        way = walk(((0, 0, -1), 3), ((1, 0, 1), 3), ((1, 0, 0), 4))
        plate = Plate(Job(PIXELS, ""), part(way, 0, 1))
        plate.feed(part(way, 1, len(way)))
        fixed, tip, _ = plate.take_path()
        assert np.frombuffer(fixed + tip, CORNER).tolist() == [(0, 0, 0), (3, 0, 1), (7, 0, 0)]


class TestRight:
    def test_needs_every_pixel_and_the_tool_back(self):
        there = walk((DOWN, Z_TRAVEL), ((0, 1, 0), PIXEL_STEPS), ((1, 0, 0), PIXEL_STEPS),
                     (UP, Z_TRAVEL), ((-1, -1, 0), PIXEL_STEPS))
        plate = Plate(Job(PIXELS, ""), part(there, 0, 1))
        assert plate.at_origin and not plate.right
        plate.feed(part(there, 1, len(there) - 1))
        assert plate.plant.cut.sum() == 3
        assert not plate.at_origin and not plate.right
        plate.feed(part(there, len(there) - 1, len(there)))
        assert plate.right
