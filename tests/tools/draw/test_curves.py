"""Curves: affine images, bounds, and chords within the tolerance of the true curve."""

from cmath import exp
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tools.draw.drawings import distances
from tools.draw.curves import Affine, Cubic, Ellipse, Straight

NUMBERS = st.floats(-1000, 1000, allow_subnormal=False).map(lambda x: round(x, 3))
POINTS = st.builds(complex, NUMBERS, NUMBERS)
CURVES = st.one_of(
    st.builds(Straight, POINTS, POINTS),
    st.builds(Cubic, POINTS, POINTS, POINTS, POINTS),
    st.builds(Ellipse, POINTS, POINTS, POINTS, st.floats(-pi, pi),
              st.floats(0.01, 2 * pi) | st.floats(-2 * pi, -0.01)))
PARAMETERS = np.linspace(0, 1, 400)


def points_of(curve):
    """Return many points of a curve."""
    if isinstance(curve, Straight):
        return curve.start + (curve.end - curve.start) * PARAMETERS
    return curve.at(PARAMETERS)


@given(CURVES, st.sampled_from([0.01, 0.1, 1.0]))
def test_chords_are_within_the_tolerance(curve, tolerance):
    chords = curve.chords(tolerance)
    assert distances(points_of(curve), chords).max() <= tolerance + 1e-9
    assert np.abs(chords[[0, -1]] - [curve.start, curve.end]).max() < 1e-9


def test_chords_are_not_many_more_than_needed():
    circle = Ellipse(0, 100, 100j, 0, 2 * pi)
    sagitta = 0.1  # of a chord over an angle: r (1 - cos(angle / 2))
    needed = pi / np.arccos(1 - sagitta / 100)
    assert needed <= len(circle.chords(sagitta)) - 1 <= needed + 1


@given(CURVES)
def test_bounds_are_those_of_the_curve(curve):
    bounds, points = curve.bounds(), points_of(curve)
    for part in (np.real, np.imag):
        # Between samples a curve goes a little farther, and bounds are exact.
        spare = 1e-9 + 0.02 * np.ptp(part(points))
        assert part(points).min() - spare <= part(bounds).min() <= part(points).min() + 1e-6
        assert part(points).max() - 1e-6 <= part(bounds).max() <= part(points).max() + spare


@given(CURVES, POINTS, POINTS, POINTS)
def test_an_image_has_the_images_of_the_points(curve, x, y, origin):
    affine = Affine(x, y, origin)
    moved = points_of(curve.moved(affine))
    assert np.abs(moved - [affine(complex(point)) for point in points_of(curve)]).max() < 1e-4


def test_transforms_nest_from_the_outside():
    turn, shift = Affine(1j, -1), Affine(origin=3 + 1j)
    assert turn.after(shift)(0) == pytest.approx(1j * (3 + 1j))
    assert shift.after(turn)(1) == pytest.approx(1j + 3 + 1j)
    assert turn.determinant == 1 and Affine(2, 3j).determinant == 6
    assert Affine(1 + 1j, 2 + 2j).determinant == 0


def test_a_quadratic_curve_is_the_same_as_a_cubic_one():
    t = PARAMETERS
    expected = (1 - t) ** 2 * 0 + 2 * t * (1 - t) * (3 + 4j) + t**2 * 6
    assert Cubic.quadratic(0, 3 + 4j, 6).at(t) == pytest.approx(expected)


def test_an_ellipse_begins_and_ends_where_it_says():
    part = Ellipse(1, 2, 1j, pi / 2, -pi / 2)
    assert part.start == pytest.approx(1 + 1j) and part.end == pytest.approx(3)
    turned = part.moved(Affine(exp(1j), 1j * exp(1j)))
    assert turned.end == pytest.approx(3 * exp(1j))


def test_an_inverse_undoes():
    affine = Affine(2 + 1j, 1 - 3j, 5 + 7j)
    for point in (0j, 1 + 2j, -4 + 5j):
        assert affine.inverse()(affine(point)) == pytest.approx(point)


def test_the_corners_of_an_ellipse_are_around_it():
    arc = Ellipse(1 + 2j, 3 + 1j, -1 + 2j, 0.3, 5)
    points, corners = arc.bounds(), np.array(arc.corners())
    assert points.real.min() >= corners.real.min() and points.real.max() <= corners.real.max()
    assert points.imag.min() >= corners.imag.min() and points.imag.max() <= corners.imag.max()
