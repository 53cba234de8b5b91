"""Programs: G-code that says the same lines again, and the commands of the first firmware."""

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fresa_host.gcode_lines import program
from tb.models.gcode_language import Interpreter, Line, Pause, Spindle, words
from tools.console import UserError
from tools.draw.program import gcode, number, original, sections, strokes
from tools.draw.wall import Part, Wall

WALL = Wall(2000, 1500)
LINES = [np.array([300 + 400j, 500 + 400j, 500 + 600.123j]), np.array([700 + 800j, 700 + 800j])]
COORDINATES = st.floats(0, 1500)


def drawn(text, height):
    """Return what a program draws by the model of the language: lines, y down, in mm; pauses."""
    machine, down, at = Interpreter(), False, 0j
    lines, pauses = [], 0
    for _, block in program(text.splitlines()):
        assert len(block) <= 40
        for action in machine.line(words(block)):
            if isinstance(action, Spindle):
                down = bool(action.direction)
                if down:
                    lines.append([at])
            elif isinstance(action, Line):
                x, y, z = (each / 1e6 for each in action.target)
                at = complex(x, height - y)
                assert z == 0 and (action.feed is None) == (not down)
                if down:
                    lines[-1].append(at)
            elif isinstance(action, Pause):
                pauses += 1
                assert not down
    assert not down
    return [np.array(line) for line in lines], at, pauses


@given(st.lists(st.lists(st.builds(complex, COORDINATES, COORDINATES), min_size=2, max_size=6)
                .map(np.array), min_size=1, max_size=5), st.sampled_from([0.0, 0.25]))
def test_gcode_says_the_same_lines(lines, dwell):
    text = gcode([Part("a", "#000000", lines), Part("b", "#000000", lines[:1])], WALL, 1800, dwell)
    found, end, pauses = drawn(text, WALL.height)
    assert end == WALL.resting and pauses == 1 and len(found) == len(lines) + 1
    for line, seen in zip([*lines, lines[0]], found, strict=True):
        exact = np.round(line, 2)
        kept = np.append(True, np.abs(np.diff(exact)) > 1e-6)
        expected = exact[kept]
        assert len(seen) == len(expected) and np.abs(seen - expected).max() < 0.0151


def test_y_goes_up_from_the_lower_edge():
    text = gcode([Part("a", "#000000", LINES[:1])], WALL, 1200)
    assert text.splitlines() == [
        "G21 G90 G94 G54", "M5", "(pen 1 of 1: a)", "G0 X300 Y1100", "M3 S1000",
        "G1 X500 F1200", "Y899.88", "M5", "G0 X1000 Y750", "M2"]


def test_pens_are_changed_at_rest_with_the_pen_up():
    parts = [Part("red ~!?(;\u00e4)", "#ff0000", LINES), Part("blue", "#0000ff", LINES[:1])]
    text = gcode(parts, WALL, 1200, 0.2)
    before, after = text.split("M0 (change to pen 2: blue)\n")
    assert before.endswith("M5\nG4 P0.2\nG0 X1000 Y750\n") and after.startswith("(pen 2 of 2: blue")
    assert "M2" not in before and after.endswith("G0 X1000 Y750\nM2\n")
    assert text.isascii() and not re.search("[~!?;]", text)
    assert "(pen 1 of 2: red _______)" in before
    first, second = sections(parts, WALL, 1200, 0.2)
    assert (first.pen, second.pen) == (parts[0].name, "blue")
    assert "\n".join(first.lines) + "\n" == before and "\n".join(second.lines) + "\n" == after


def test_a_dot_is_put_down():
    text = gcode([Part("a", "#000000", LINES[1:])], WALL, 1200)
    assert "G0 X700 Y700\nM3 S1000\nG4 P0.1\nM5\n" in text
    text = gcode([Part("a", "#000000", LINES[1:])], WALL, 1200, 0.3)
    assert "G0 X700 Y700\nM3 S1000\nG4 P0.3\nM5\nG4 P0.3\n" in text


def test_a_pen_may_stay_down_between_lines_that_meet():
    lines = [np.array([0, 10]), np.array([10.001, 10j]), np.array([20j, 30]), np.array([30, 30])]
    part = Part("a", "#000000", [line.astype(complex) for line in lines])
    assert [len(group) for group in strokes(part, WALL)] == [2, 2]
    assert len(strokes(part, WALL, 0.1)) == 4


@pytest.mark.parametrize(("value", "text"), [
    (1.0, "1"), (-0.001, "0"), (1.005, "1"), (0.5, "0.5"), (1200.25, "1200.25"), (100.0, "100")])
def test_numbers_are_short(value, text):
    assert number(value) == text


def test_commands_of_the_first_firmware():
    commands = original(Part("a", "#000000", LINES), WALL).splitlines()
    assert commands == [
        ":P1", ":H", ":I03000400", ":F05000400", ":I05000400", ":F05000600",
        ":I07000800", ":F07000800", ":I10000750"]


def test_a_curve_in_whole_millimetres_stays_within_one():
    circle = 800 + 700j + 300 * np.exp(2j * np.pi * np.linspace(0, 1, 2000))
    commands = original(Part("a", "#000000", [circle]), WALL).splitlines()[2:-1]
    points = [complex(int(each[2:6]), int(each[6:])) for each in commands]
    assert all(each[1] == "IF"[n % 2] for n, each in enumerate(commands))
    assert points[1:-1:2] == points[2::2]  # each line begins where the last has ended
    assert np.abs(np.abs(np.array(points) - 800 - 700j) - 300).max() < 1.3
    assert all(a != b for a, b in pairwise(points[::2])) and len(commands) < 200


def test_four_digits_are_not_enough():
    with pytest.raises(UserError, match="four digits"):
        original(Part("a", "#000000", LINES), Wall(10_000, 1500))
