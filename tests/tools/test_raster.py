"""The algorithms on pixels, against their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tools.raster import otsu, outlined, thinned

SHAPES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=12)
BITS = arrays.arrays(bool, SHAPES)
GREYS = arrays.arrays(np.uint8, SHAPES)


def figures(pixels: np.ndarray, *, diagonal: bool) -> np.ndarray:
    """Number each connected figure from 1; 0 where nothing is set. Slow and plain."""
    numbers = np.zeros(pixels.shape, int)
    steps = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if diagonal or 0 in (r, c)]
    last = 0
    for start in map(tuple, np.argwhere(pixels)):
        if numbers[start]:
            continue
        last += 1
        numbers[start] = last
        todo = [start]
        while todo:
            row, column = todo.pop()
            for r, c in steps:
                place = row + r, column + c
                inside = 0 <= place[0] < pixels.shape[0] and 0 <= place[1] < pixels.shape[1]
                if inside and pixels[place] and not numbers[place]:
                    numbers[place] = last
                    todo.append(place)
    return numbers


def drawn(text: str) -> np.ndarray:
    return np.array([[mark == "#" for mark in line] for line in text.split()])


class TestOtsu:
    @given(arrays.arrays(np.uint8, st.integers(1, 60)))
    def test_against_its_definition(self, greys):
        """The variance inside the two parts, weighted, is the lowest that any threshold gives."""

        def inside(level: int) -> float:
            parts = greys[greys <= level], greys[greys > level]
            return sum(part.var() * part.size for part in parts if part.size)

        level = otsu(np.bincount(greys, minlength=256))
        assert inside(level) <= min(map(inside, range(255))) + 1e-6

    @given(st.integers(0, 254), st.data())
    def test_middle_of_two(self, dark, data):
        light = data.draw(st.integers(dark + 1, 255))
        level = otsu(np.bincount([dark, light, light], minlength=256))
        assert level == (dark + light - 1) // 2

    @pytest.mark.parametrize("grey", [0, 127, 128, 255])
    def test_all_alike(self, grey):
        assert otsu(np.bincount([grey], minlength=256)) == 127


class TestOutlined:
    @given(BITS)
    def test_against_its_definition(self, pixels):
        got = outlined(pixels)
        for (row, column), here in np.ndenumerate(pixels):
            beside = [(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)]
            clear = [
                not (0 <= r < pixels.shape[0] and 0 <= c < pixels.shape[1] and pixels[r, c])
                for r, c in beside
            ]
            assert got[row, column] == (here and any(clear))


class TestThinned:
    @given(arrays.arrays(bool, arrays.array_shapes(min_dims=2, max_dims=2, max_side=20)))
    def test_adds_nothing_and_rests(self, pixels):
        got = thinned(pixels)
        assert (got <= pixels).all()
        assert (thinned(got) == got).all()

    @pytest.mark.parametrize("seed", range(8))
    def test_keeps_figures_and_holes(self, seed):
        random = np.random.default_rng(seed)
        # Blobs of all sizes: noise, smoothed over more and more.
        noise = random.random((60, 60))
        for _ in range(seed % 4):
            noise = sum(np.roll(noise, shift, axis) for axis in (0, 1) for shift in (-1, 0, 1))
        pixels = noise < np.quantile(noise, random.uniform(0.2, 0.8))
        self.check(pixels)

    def test_keeps_figures_and_holes_of_every_small_picture(self):
        # All 4096 pictures of 3 x 4, side by side with room between.
        bits = (np.arange(2**12)[:, None] >> np.arange(12) & 1).astype(bool)
        mosaic = np.zeros((64, 5, 64, 6), bool)
        mosaic[:, 1:4, :, 1:5] = bits.reshape(64, 64, 3, 4).transpose(0, 2, 1, 3)
        self.check(mosaic.reshape(64 * 5, 64 * 6))

    def check(self, pixels):
        got = thinned(pixels)
        assert (got <= pixels).all()
        before = figures(pixels, diagonal=True)
        # Each figure keeps a pixel, and there are no more figures: each is still in one piece.
        assert set(before[got]) == set(before[pixels])
        assert figures(got, diagonal=True).max() == before.max()
        outside = np.pad(pixels, 1), np.pad(got, 1)
        holes = [figures(~where, diagonal=False).max() for where in outside]
        assert holes[0] == holes[1]

    def test_bar_becomes_its_middle_line(self):
        bar = np.zeros((9, 40), bool)
        bar[2:7, 2:38] = True
        got = thinned(bar)
        assert (got.sum(axis=0) <= 1).all()
        assert set(np.argwhere(got)[:, 0]) <= {3, 4, 5}
        assert got.sum() >= 30

    def test_line_stays(self):
        line = drawn("#....... .##..... ...###.. ......#. ......#.")
        assert (thinned(line) == line).all()
