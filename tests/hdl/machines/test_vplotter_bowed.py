# amaranth: UnusedElaboratable=no

"""`vplotter` with lines that are bowed, as those of the thesis."""

from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np
import pytest

from fresa.machines.vplotter import VPlotter, VPlotterSettings
from tb.boards import component
from tb.machines.vplotter.scenarios import WallSession, from_chord
from tb.wall_plant import hanging
from tests.hdl.machines.test_vplotter import (
    SETTINGS,
    STEP,
    apart,
    command,
    home,
    started,
    where,
)

BOWED = replace(SETTINGS, bowed=True)
WIDTH = SETTINGS.wall_width
PAGE = Path(__file__).parents[3] / "docs" / "vplotter.md"

pytestmark = [pytest.mark.compiler, pytest.mark.long]


@pytest.fixture(scope="module")
def design():
    return component("vplotter", VPlotter(settings=BOWED))


@pytest.fixture
def session(design):
    with started(design, BOWED) as made:
        yield made


def start(session: WallSession, x: int, y: int) -> None:
    command(session, f":I{x:04}{y:04}", "Going to the start point.")
    assert session.take(4_000_000, b"\r\n").startswith(b"At the start point.")
    session.path.clear()


def strings(place) -> tuple[float, float]:
    return hypot(*place), hypot(WIDTH - place[0], place[1])


@pytest.mark.parametrize(("begin", "end"), [
    ((5, 15), (55, 15)), ((50, 58), (12, 20)), ((30, 12), (30, 60)), ((0, 30), (0, 30)),
    ((10, 40), (11, 40))])
def test_each_string_changes_its_length_at_a_constant_speed(session, begin, end):
    home(session)
    start(session, *begin)
    motors = session.plant.left, session.plant.right
    nearest = [motor.nearest for motor in motors]
    for motor in motors:
        motor.nearest = 1 << 62
    command(session, f":F{end[0]:04}{end[1]:04}", "Drawing.", 400_000)
    assert session.take(8_000_000, b"\r\n").startswith(b"Line drawn. Give a start point")
    session.rest()
    if begin != end:
        assert min(motor.nearest for motor in motors) == BOWED.pace
    for motor, least in zip(motors, nearest, strict=True):
        motor.nearest = min(motor.nearest, least)
    apart(session, end)
    assert where(session) == pytest.approx(end, abs=0.01)
    firsts, lasts = strings(begin), strings(end)
    (line,) = session.path or [[begin]]
    longer = max((0, 1), key=lambda side: abs(lasts[side] - firsts[side]))
    whole = lasts[longer] - firsts[longer]
    for place in line:
        found = strings(place)
        part = (found[longer] - firsts[longer]) / whole if whole else 0
        for length, first, last in zip(found, firsts, lasts, strict=True):
            assert length == pytest.approx(first + part * (last - first), abs=1.6 * STEP)
    if hypot(end[0] - begin[0], end[1] - begin[1]) > 20:
        left, right = ((a + b) / 2 for a, b in zip(firsts, lasts, strict=True))
        half = complex(hanging(left, right, WIDTH))
        bow = from_chord([(half.real, half.imag)], begin, end)
        assert from_chord(line, begin, end) == pytest.approx(bow, rel=0.2, abs=3 * STEP)


def test_it_is_a_homing_cycle_to_the_rest_of_the_machine(session):
    home(session)
    start(session, 5, 15)
    command(session, ":S0", "15")
    command(session, ":F00550015", "Drawing.", 400_000)
    for state in ":S0", ":S1", ":S2":
        command(session, state, "2D")
    session.send("?")
    assert session.take(20_000, b">\r\n").startswith(b"<Home|")
    command(session, ":I00100020", "Busy: wait until it stands.")
    session.send("!")  # which does nothing, as in homing
    assert session.take(8_000_000, b"\r\n").startswith(b"Line drawn.")
    session.send("?")
    assert session.take(20_000, b">\r\n").startswith(b"<Idle|")
    apart(session, (55, 15))
    command(session, ":S0", "05")


@pytest.mark.parametrize(("end", "line"), [
    ((0, 40), "G1Y10F6000"), ((60, 40), "G1Y10F6000"), ((30, 60), "G1X10F6000"),
    ((30, 10), "G1X10F6000")])
def test_at_an_edge_it_is_within_the_limits(session, end, line):
    home(session)
    start(session, 30, 30)
    command(session, f":F{end[0]:04}{end[1]:04}", "Drawing.", 400_000)
    session.take(8_000_000, b"\r\n")
    apart(session, end)
    assert session.ask(line, "ok") == b"ok\r\n"
    session.rest()
    assert b"ALARM" not in session.texts


def test_an_end_switch_ends_it(session):
    home(session)
    start(session, 10, 40)
    command(session, ":F00500030", "Drawing.", 400_000)
    session.run(100_000)
    session.plant.left.switch = 1 << 30
    assert b"ALARM:1\r\n" in session.take(100_000, b"ALARM:1\r\n")
    steps = session.plant.left.steps, session.plant.right.steps
    session.take(200_000)
    assert steps == (session.plant.left.steps, session.plant.right.steps)
    session.plant.left.switch = 20
    assert session.ask("\x18$X", "ok").endswith(b"ok\r\n")
    command(session, ":F00200030", "The place is unknown. Home first: :H")


def test_it_sags_as_far_as_the_page_says():
    wall = VPlotterSettings()
    long = hypot(wall.wall_width, wall.wall_height)
    left = np.linspace(wall.wall_height, long, 10_001)
    places = hanging(left, left[::-1], wall.wall_width)
    sags = round(places.imag.max() - wall.wall_height)
    assert f"lower right one it sags by {sags} mm" in " ".join(PAGE.read_text().split())


@pytest.mark.parametrize("name", ["", "stop", "motor_fault", "door"])
def test_what_ends_it_forgets_the_place(session, name):
    """A reset does, and a contact, after which a reset is wanted; with the door it is its own."""
    home(session)
    start(session, 5, 15)
    command(session, ":F00550015", "Drawing.", 400_000)
    session.run(100_000)
    if name:
        session.engine.set(**{name: 1})
        session.run(20_000)
        session.engine.set(**{name: 0})
        session.run(20_000)
    if name != "door":
        session.send("\x18")
    assert b"Stopped before the end." in session.take(60_000, b"unlock]\r\n")
    before = session.pen
    session.run(200_000)
    assert session.pen == before and not session.engine.get("pen")
    command(session, ":I00100020", "The place is unknown. Home first: :H")
    assert session.ask("$H", "ok", 8_000_000) == b"ok\r\n"
    session.rest()
    apart(session, SETTINGS.rest)
