"""Where a pen hangs from two strings, and what a wall that was measured wrongly makes of lines."""

from math import hypot

import pytest

from fresa.drive import HALF_STEP
from tb.wall_plant import StringPlant, WallPlant, hanging

WIDTH = 1768


def drawn(x: float, y: float, *, wider: float = 0, longer: float = 1) -> tuple[float, float]:
    """Return where the pen hangs for a place, on a wall that is wider, with strings that are."""
    place = complex(hanging(longer * hypot(x, y), longer * hypot(WIDTH - x, y), WIDTH + wider))
    return place.real, place.imag


@pytest.mark.parametrize(("x", "y"), [(0, 300), (884, 200), (1768, 900), (400, 1700)])
def test_a_pen_hangs_where_the_strings_meet(x, y):
    assert drawn(x, y) == pytest.approx((x, y))


def test_slack_and_torn_strings():
    places = hanging([300, 2500, 800], [2500, 300, 900], WIDTH)
    assert places == pytest.approx([300j, WIDTH + 300j, WIDTH * 8 / 17])
    plant = WallPlant(WIDTH, 1, 300, 400)
    assert plant.pen and not plant.torn
    plant.right.length = 1200
    assert plant.pen and plant.torn


def test_a_wall_that_is_wider_than_was_said_lifts_the_middle_of_a_level_line():
    """The figures of docs/vplotter.md."""
    for wider in (1, -1):
        ends = [drawn(x, 500, wider=wider)[1] for x in (0, WIDTH)]
        assert ends == pytest.approx([500, 500], abs=0.01)
        off = drawn(WIDTH / 2, 500, wider=wider)[1] - 500
        assert off == pytest.approx(-0.9 * wider, abs=0.03)
        assert -1.1 * off == pytest.approx(wider, abs=0.05)


def test_a_straight_line_that_is_too_long_says_that_all_is_larger():
    """With strings that are longer than was said, a wall that straightens lines is larger, too."""
    places = [drawn(x, 500, longer=1.001, wider=WIDTH * 0.001) for x in (384, 884, 1384)]
    assert places[2][0] - places[0][0] == pytest.approx(1001)
    assert [y for _, y in places] == pytest.approx([500.5] * 3)
    bent = [drawn(x, 500, longer=1.001)[1] for x in (0, 884)]
    assert bent[1] - bent[0] == pytest.approx(1.56, abs=0.02)


def test_a_motor_winds_its_string_until_the_switch_closes():
    string = StringPlant(12, switch=10)
    for clock, row in enumerate((0, 7, 6, 6, 5)):
        string.feel(10 * clock, HALF_STEP[row])
    assert (string.length, string.steps, string.nearest, string.closed) == (9, 3, 10, True)
    string.feel(50, HALF_STEP[1])
    assert string.jumps == 1
    string.feel(60, 0)
    assert string.length == 9


def test_a_motor_may_turn_the_other_way():
    string = StringPlant(12, flipped=True)
    for clock, row in enumerate((0, 7, 6)):
        string.feel(clock, HALF_STEP[row])
    assert string.length == 14


def test_the_plant_says_how_long_its_switches_stay():
    plant = WallPlant(100, 10, 30, 40, switch_mm=1, period=7)
    assert plant.levels == {"limits": 0} and plant.free == 7 * 499
    assert plant.pen == pytest.approx((30, 40), abs=0.1)
    plant.left.length = 9
    assert plant.levels == {"limits": 1} and plant.free == 7
