"""`benchmarks.beside_grbl`: its model of GRBL against closed forms, its jobs, and its table."""

import json
from math import hypot, inf, pi, sqrt

import numpy as np
import pytest

from benchmarks import grbl
from benchmarks.beside_grbl import (
    FEED,
    FIGURES,
    JOBS,
    PAGE,
    SETTINGS,
    motions,
    path,
    table,
    text,
)
from benchmarks.pages import with_figures

MACHINE = grbl.Machine(steps=100, speed=100, acceleration=500)


def line(x: float, y: float = 0, feed: float = 50) -> grbl.Block:
    return grbl.blocks(MACHINE, [((x, y), feed)])[0]


class TestModel:
    def test_a_line_is_a_trapezoid_or_a_triangle(self):
        assert grbl.duration([line(20)]) == pytest.approx(20 / 50 + 50 / 500)
        assert grbl.duration([line(2)]) == pytest.approx(2 * sqrt(2 / 500))
        assert grbl.duration([line(-50, feed=inf)]) == pytest.approx(50 / 100 + 100 / 500)

    def test_lines_that_go_on_straight_are_one_as_far_as_they_are_seen(self):
        made = grbl.blocks(MACHINE, [((float(x), 0.0), 100.0) for x in range(1, 61)])
        assert grbl.duration(made, 60) == pytest.approx(60 / 100 + 100 / 500)
        assert grbl.duration(made, 1) == pytest.approx(60 * 2 * sqrt(1 / 500))
        cruise = 60 / sqrt(2 * 500 * 5)  # braking over 5 blocks, sawtooth at each
        assert cruise < grbl.duration(made, 5) < 1.3 * cruise

    @pytest.mark.parametrize(("end", "speed2"), [
        ((20.0, 0.0), inf), ((0.0, 0.0), 0.0),
        ((10.0, 10.0), 500 * sqrt(2) * 0.01 * sqrt(0.5) / (1 - sqrt(0.5)))])
    def test_a_corner_has_the_speed_of_its_angle(self, end, speed2):
        made = grbl.blocks(MACHINE, [((10.0, 0.0), 50.0), (end, 50.0)])
        assert made[1].junction == pytest.approx(speed2)

    def test_a_line_without_a_step_is_none(self):
        assert len(grbl.blocks(MACHINE, [((1.0, 0.0), 50.0), ((1.004, 0.0), 50.0)])) == 1

    @pytest.mark.parametrize("clockwise", [False, True])
    def test_chords_are_within_the_tolerance_of_their_arc(self, clockwise):
        ends = np.array([(10.0, 0.0), *grbl.chords((10, 0), (0, 10), (0, 0), clockwise, 0.002)])
        middle = np.hypot(*(ends[1:] + ends[:-1]).T / 2)
        assert 0.0015 < (10 - middle).max() < 0.0021
        assert np.hypot(*ends.T) == pytest.approx(10)
        way = sum(hypot(*by) for by in np.diff(ends, axis=0))
        assert way == pytest.approx(pi * (15 if clockwise else 5), rel=1e-3)

    def test_places_are_those_of_bresenham(self):
        made = grbl.blocks(MACHINE, [((0.05, 0.02), 10.0), ((0.05, 0.03), 10.0)])
        assert grbl.walked(made).tolist() == [
            [1, 0], [2, 1], [3, 1], [4, 2], [5, 2], [5, 3]]

    @pytest.mark.parametrize(("feed", "level"), [(100, 0), (50, 1), (30, 2), (10, 3)])
    def test_steps_of_a_line_are_all_made_in_ticks_of_its_longer_axis(self, feed, level):
        block = line(30, 18, feed * hypot(1, 0.6))
        long, short = grbl.step_instants(block)
        assert len(long) == 3000 and len(short) == 1800
        assert long[-1] == pytest.approx(grbl.duration([block]), abs=0.02)
        tick = 1 / feed / 100 / 2**level
        middle = np.diff(short)[850:950]
        assert middle / tick == pytest.approx(np.rint(middle / tick), abs=0.01)
        assert len({*np.rint(middle / tick)}) == 2


class TestJobs:
    @pytest.mark.parametrize("name", JOBS)
    def test_both_machines_go_the_same_way(self, name):
        moves = JOBS[name]()
        blocks = motions(SETTINGS, text(moves))
        ends = np.cumsum([block.steps[:2] for block in blocks], axis=0)
        points = path(moves)
        assert abs(ends[-1]).max() == 0 and points[-1][0] == (0, 0)
        theirs = {tuple(np.floor(np.array(point) * SETTINGS.steps + 0.5).astype(int).tolist())
                  for point, _ in points}
        assert {*map(tuple, ends.tolist())} <= theirs
        assert all(feed in (FEED, inf) for _, feed in points)


def test_the_table_of_the_page_has_the_figures():
    found = json.loads(FIGURES.read_text(encoding="utf-8"))
    page = PAGE.read_text(encoding="utf-8")
    assert table(found) in page, "run python -m benchmarks.beside_grbl --write"
    assert with_figures(page, "beside_grbl", table(found)) == page
