"""How far lines are from each other."""

import numpy as np
import pytest

from tests.tools.draw.drawings import distances as slow
from tools.draw.compare import compare, distances, joined

SQUARE = np.array([0, 10, 10 + 10j, 10j, 0], complex)


def allowed(places):
    return np.full(len(places), 0.5)


def drawn(line, step=0.1):
    along = np.concatenate([[0], np.abs(np.diff(line)).cumsum()])
    return np.interp(np.arange(0, along[-1] + step / 2, step), along, line)


def test_distances_are_those_of_the_nearest_segment():
    random = np.random.default_rng(2)
    line = (random.normal(size=400) + 1j * random.normal(size=400)).cumsum()
    points = (random.normal(size=1500) + 1j * random.normal(size=1500)).cumsum()
    assert distances(points, line) == pytest.approx(slow(points, line))
    assert distances(points, line[:1]) == pytest.approx(np.abs(points - line[0]))
    assert len(distances(points[:0], line)) == 0


def test_a_line_that_is_right():
    found = compare([SQUARE], [drawn(SQUARE) + 0.1j], allowed)
    assert found.right and found.worst == pytest.approx(0.1) and found.line == 1
    assert found.beyond == pytest.approx(-0.4) and found.limit == 0.5


@pytest.mark.parametrize(("path", "worst", "where"), [
    (np.array([0, 10, 10 + 10j, 0]), 50**0.5, 5 + 5j),  # a corner is left out
    (np.array([0, 10, 10 + 10j, 10j]), 10, 10j),  # it is not closed
    (np.array([0, 10, 11 + 5j, 10 + 10j, 10j, 0]), 1, 11 + 5j),  # bowed
    (np.array([0, 10, 10, 10 + 10j, 10j, 2j]), 2, 0j),  # too short
])
def test_what_is_wrong_is_found(path, worst, where):
    found = compare([SQUARE[:2], SQUARE], [drawn(SQUARE[:2]), drawn(path.astype(complex))],
                    allowed)
    assert not found.right and found.line == 2
    assert found.worst == pytest.approx(worst, abs=0.1)
    assert abs(found.where - where) < 0.2 or worst in (10, 50**0.5)


def test_a_line_from_its_end_to_its_begin_is_wrong():
    line = SQUARE[:3]
    found = compare([line], [drawn(line[::-1])], allowed)
    assert not found.right and found.worst == pytest.approx(200**0.5)


@pytest.mark.parametrize("lines", [[], [SQUARE] * 3])
def test_lines_that_are_missing_or_too_many_are_wrong(lines):
    found = compare([SQUARE] * 2, lines, allowed)
    assert not found.right and (found.asked, found.drawn) == (2, len(lines))
    assert found.worst < 1e-9


def test_lines_that_meet_are_joined_where_they_may_be():
    lines = [np.array(line, complex) for line in ([0, 1], [1, 2], [2, 3], [5, 6], [6, 7])]
    for counts, expected in (([1] * 5, 5), ([2, 1, 2], 3), ([3, 1, 1], 3), ([5, 5], 2), ([], 5),
                             ([2, 9, 9, 9, 9], 5), ([2, 1, 1, 1], 4)):
        made = joined(lines, counts)
        assert len(made) == expected
        assert np.concatenate(made).tolist() == np.concatenate(lines).tolist()
    assert joined([], [2]) == []
