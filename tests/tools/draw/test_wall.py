"""Where a drawing comes on the wall, and how close its chords are to its curves there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tools.draw.drawings import distances, write
from tools.console import UserError
from tools.draw.plan import plan
from tools.draw.svg import MM_PER_PX, read_drawing
from tools.draw.wall import Wall, place

WALL = Wall()
SIZES = st.floats(0.01, 1e6)


@given(SIZES, SIZES, st.complex_numbers(max_magnitude=1e5))
def test_it_becomes_as_large_as_the_area_allows(width, height, corner):
    placed = place(corner, corner + complex(width, height), WALL)
    size, room = placed.high - placed.low, WALL.high - WALL.low
    assert size.real / size.imag == pytest.approx(width / height, rel=1e-3)
    assert max(size.real / room.real, size.imag / room.imag) == pytest.approx(1)
    assert (placed.low + placed.high) / 2 == pytest.approx((WALL.low + WALL.high) / 2)
    assert placed.affine(corner) == pytest.approx(placed.low, abs=1e-3)
    assert WALL.contains(np.array([placed.low, placed.high]))


def test_places_and_sizes_that_are_asked_for():
    by_width = place(10, 30 + 10j, WALL, width=500)
    assert (by_width.high - by_width.low) == pytest.approx(500 + 250j)
    at = place(10, 30 + 10j, WALL, width=500, at=300 + 400j)
    assert (at.low, at.high) == (pytest.approx(300 + 400j), pytest.approx(800 + 650j))
    own = place(0, (96 + 192j), WALL, scale=1, at=300 + 400j)
    assert own.high - own.low == pytest.approx(25.4 + 50.8j) and own.scale == pytest.approx(1)
    filled = place(0, 1 + 1j, WALL, at=1000 + 300j)
    assert filled.high == pytest.approx(1668 + 968j)
    flat = place(0, 100, WALL)
    assert flat.low.imag == flat.high.imag == (WALL.low + WALL.high).imag / 2
    dot = place(5, 5, WALL)
    assert dot.low == dot.high


@pytest.mark.parametrize("options", [
    {"width": 1569.0}, {"width": 1500.0, "at": 200 + 300j}, {"at": 50 + 300j, "width": 10.0},
    {"at": 300 + 100j, "width": 10.0}, {"at": 1700 + 300j}, {"scale": 1e4},
])
def test_what_does_not_fit_is_refused(options):
    with pytest.raises(UserError, match="beyond the area from 100,200 to 1668,1668"):
        place(0, 100 + 100j, WALL, **options)


def test_walls_that_cannot_be():
    with pytest.raises(UserError, match="leave no place"):
        Wall(300, 300)
    with pytest.raises(UserError, match="the place of rest, 2000,5, is not on the wall"):
        Wall(rest=2000 + 5j)
    with pytest.raises(UserError, match="884,100, is above where the plotter draws, which begins"):
        Wall(rest=884 + 100j)
    assert Wall(2000, 1000).resting == 1000 + 500j


@pytest.mark.parametrize("tolerance", [0.05, 0.5])
@pytest.mark.parametrize("vpype", [False, pytest.param(True, marks=pytest.mark.vpype)])
def test_lines_on_the_wall_are_within_the_tolerance_of_the_curves(tmp_path, tolerance, vpype):
    path = write(tmp_path, '<g transform="rotate(10) skewX(20)" fill="none" stroke="red">'
                 '<path d="M0 0C50 -80 60 120 90 10A30 20 15 1 1 40 40Q10 90 0 50z"/></g>')
    drawing = read_drawing(path)
    planned = plan(drawing, WALL, tolerance=tolerance, vpype=vpype)
    line, = planned.lines
    t = np.linspace(0, 1, 500)
    curves = [curve.moved(planned.placement.affine) for curve in drawing.shapes[0].outlines[0]]
    true = np.concatenate([curve.at(t) if hasattr(curve, "at") else
                           curve.start + (curve.end - curve.start) * t for curve in curves])
    assert distances(true, line).max() <= tolerance + 1e-6
    fine = line[:-1, None] + np.diff(line)[:, None] * np.linspace(0, 1, 30)
    assert distances(fine.ravel(), true).max() <= tolerance + 1e-3
    assert len(line) < 2000 and WALL.contains(line)
    assert line[0] == line[-1]


def test_tolerance_is_that_of_the_wall(tmp_path):
    path = write(tmp_path, '<circle r="1"/>')
    counts = [len(plan(read_drawing(path), WALL, width=width, vpype=False).lines[0])
              for width in (10, 1000)]
    assert counts[1] == pytest.approx(10 * counts[0], rel=0.3)


def test_pens(tmp_path):
    drawing = read_drawing(write(tmp_path, """
        <g inkscape:groupmode="layer" inkscape:label="A"><rect width="5" height="5" fill="red"/>
        <rect x="9" width="5" height="5" fill="blue"/></g>
        <g inkscape:groupmode="layer" inkscape:label="B"><circle r="5" fill="red"/></g>
        <circle r="2" fill="blue"/><circle r="3" fill="blue"/>"""))

    def pens(kind):
        return [(part.name, part.colour, len(part.lines))
                for part in plan(drawing, WALL, pens=kind).parts]

    assert pens(None) == pens("layer") == [
        ("A", "#ff0000", 2), ("B", "#ff0000", 1), ("no layer", "#0000ff", 2)]
    assert pens("colour") == [("#ff0000", "#ff0000", 2), ("#0000ff", "#0000ff", 3)]
    assert pens("one") == [("all", "#0000ff", 5)]


def test_own_size_is_in_the_units_of_the_file(tmp_path):
    drawing = read_drawing(write(tmp_path, '<rect width="10" height="5"/>',
                                 'width="20cm" height="20cm" viewBox="0 0 20 20"'))
    low, high = drawing.bounds()
    assert (high - low) * MM_PER_PX == pytest.approx(100 + 50j, rel=1e-5)
