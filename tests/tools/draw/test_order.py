"""The order of lines: nothing is lost or drawn twice, and no order is longer than the first."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tools.draw.drawings import distances
from tools.draw.order import (
    deduplicated,
    merged,
    nearest,
    ordered,
    simplified,
    travel,
    turned,
    two_opt,
)

WHOLE = st.integers(0, 30)
POINTS = st.builds(complex, WHOLE, WHOLE)
LINES = st.lists(st.lists(POINTS, min_size=2, max_size=5).map(lambda line: np.array(line, complex)),
                 max_size=12)
SORTERS = [False, pytest.param(True, marks=pytest.mark.vpype)]


def pieces(lines):
    """Return how often each straight piece is drawn, whichever its direction."""
    return Counter(frozenset((complex(a), complex(b))) for line in lines
                   for a, b in zip(line, line[1:], strict=False) if a != b)


def scattered(count, seed=1):
    random = np.random.default_rng(seed)
    starts = random.uniform(0, 1000, (count, 2)) @ [1, 1j]
    return [np.array([start, start + random.normal(0, 20) + 1j * random.normal(0, 20)])
            for start in starts]


@given(LINES)
def test_merging_keeps_every_piece_once(lines):
    joined = merged(lines, 0.0)
    assert pieces(joined) == pieces(lines) and len(joined) <= len(lines)
    for a in range(len(joined)):  # what could be joined is
        for b in range(a):
            assert {complex(p) for p in joined[a][[0, -1]]}.isdisjoint(
                {complex(p) for p in joined[b][[0, -1]]})


def test_lines_in_any_direction_are_merged():
    lines = [np.array(each, complex) for each in ([1, 2], [4, 3], [2, 3], [0, 1], [4, 5 + 1j])]
    joined, = merged(lines, 0.0)
    assert sorted(joined.tolist(), key=abs) == [0, 1, 2, 3, 4, 5 + 1j]
    assert pieces([joined]) == pieces(lines)
    near = [np.array([0, 1 + 0j]), np.array([1.04, 2 + 0j])]
    assert len(merged(near, 0.05)) == 1 and len(merged(near, 0.03)) == 2


@given(LINES, POINTS)
def test_sorting_loses_nothing(lines, rest):
    for found in (nearest(lines, rest), two_opt(lines, rest, 10**6)):
        assert pieces(found) == pieces(lines) and len(found) == len(lines)


@given(LINES, POINTS, st.integers(0, 500))
def test_two_opt_is_never_longer(lines, rest, pairs):
    for start in (lines, nearest(lines, rest)):
        done = two_opt(start, rest, pairs)
        assert travel(done, rest) <= travel(start, rest) + 1e-9


@given(LINES, POINTS)
def test_turning_closed_lines_is_never_longer_and_loses_nothing(lines, rest):
    lines = [np.append(line, line[0]) if n % 2 else line for n, line in enumerate(lines)]
    done = turned(lines, rest)
    assert pieces(done) == pieces(lines)
    assert travel(done, rest) <= travel(lines, rest) + 1e-9


def test_two_opt_ends_where_no_reversed_run_helps():
    lines = two_opt(scattered(40), 0j, 10**9)
    best = travel(lines, 0j)
    for first in range(40):
        for last in range(first, 40):
            run = [line[::-1] for line in reversed(lines[first:last + 1])]
            assert travel([*lines[:first], *run, *lines[last + 1:]], 0j) > best - 1e-6


def test_two_opt_is_bounded_by_what_it_looks_at():
    seen = []
    two_opt(scattered(100), 0j, 1000, seen.append)
    assert 1000 <= sum(seen) <= 1100


@given(st.lists(POINTS, min_size=2, max_size=40).map(lambda points: np.array(points, complex)),
       st.sampled_from([0.0, 0.5, 3.0]))
def test_simplified_lines_are_near(line, tolerance):
    fewer = simplified(line, tolerance)
    assert fewer[0] == line[0] and fewer[-1] == line[-1]
    assert distances(line, fewer).max() <= tolerance + 1e-9
    assert set(fewer.tolist()) <= set(line.tolist())


def test_a_straight_line_has_two_points():
    line = (np.arange(1000) * (1 + 2j)).astype(complex)
    assert simplified(line, 1e-9).tolist() == [0, 999 * (1 + 2j)]


def test_lines_that_are_there_twice_are_drawn_once():
    line = np.array([0, 1, 1 + 1j], complex)
    assert len(deduplicated([line, line[::-1], (line + 1e-9).astype(complex), line * 2])) == 2


@pytest.mark.parametrize("vpype", SORTERS)
@settings(max_examples=40)
@given(lines=LINES, rest=POINTS)
def test_all_together(vpype, lines, rest):
    done = ordered(lines, 1e-6, rest, vpype=vpype)
    assert done.after <= travel(deduplicated(lines), rest) + 1e-3  # one less may be a longer way
    assert done.after == travel(done.lines, rest) and done.before == travel(lines, rest)
    # Simplifying joins what is straight, so points of each must be on the other.
    for some, others in ((lines, done.lines), (done.lines, lines)):
        for line in some:
            fine = (line[:-1, None] + np.diff(line)[:, None] * np.linspace(0, 1, 7)).ravel()
            assert np.min([distances(fine, other) for other in others], axis=0).max() < 1e-4
    if len(pieces(lines)) == sum(map(len, lines)) - len(lines):  # none is there twice
        assert sum(np.abs(np.diff(line)).sum() for line in done.lines) <= 1e-3 + sum(
            np.abs(np.diff(line)).sum() for line in lines)


@pytest.mark.parametrize("vpype", SORTERS)
def test_travel_becomes_far_less(vpype):
    done = ordered(scattered(300), 0.01, 500 + 500j, vpype=vpype)
    assert done.after < done.before / 10 and len(done.lines) == 300


def test_the_order_is_the_same_each_time():
    first, second = (ordered(scattered(200), 0.01, 0j, vpype=False, effort=0.001).lines
                     for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_no_lines():
    assert ordered([], 0.1, 0j, vpype=False).lines == [] and travel([], 5j) == 0
