"""The estimate of a drawing's time."""

from math import sqrt

import numpy as np
import pytest

from tools.draw.timing import Speeds, duration_of, seconds
from tools.draw.wall import Part

SPEEDS = Speeds(feed=1800, rapid=2400, acceleration=100)


def test_a_line_is_a_trapezoid_or_a_triangle():
    ramp = 30 / 100
    assert duration_of([0, 300], 1800, SPEEDS) == pytest.approx(300 / 30 + ramp)
    assert duration_of([0, 4j], 1800, SPEEDS) == pytest.approx(2 * sqrt(4 / 100))
    assert duration_of([5, 5], 1800, SPEEDS) == 0


def test_points_on_a_line_cost_nothing():
    whole = duration_of([0, 300], 1800, SPEEDS)
    points = np.linspace(0, 300, 1000).astype(complex)
    assert duration_of(points, 1800, SPEEDS) == pytest.approx(whole)


def test_corners_are_slowed_down_for():
    straight = duration_of([0, 100, 200], 1800, SPEEDS)
    right = duration_of([0, 100, 100 + 100j], 1800, SPEEDS)
    back = duration_of([0, 100, 0], 1800, SPEEDS)
    assert straight < right < back == pytest.approx(2 * duration_of([0, 100], 1800, SPEEDS))
    # By junction deviation: v^2 = a d s / (1 - s), s the sine of half the angle between.
    v = sqrt(100 * 0.01 * sqrt(0.5) / (1 - sqrt(0.5)))
    expected = 2 * (100 / 30 + (30**2 / 200 + (30 - v)**2 / 200) / 30)
    assert right == pytest.approx(expected)


def test_both_ways_and_the_pen_itself():
    part = Part("a", "#000000", [np.array([0, 100 + 0j]), np.array([100 + 50j, 50j])])
    down, up = seconds([part], 0j, SPEEDS._replace(dwell=0.5))
    assert down == pytest.approx(2 * duration_of([0, 100], 1800, SPEEDS))
    assert up == pytest.approx(4 * 0.5 + 2 * duration_of([0, 50], 2400, SPEEDS))
