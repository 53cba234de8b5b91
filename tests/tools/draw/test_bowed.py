# amaranth: UnusedElaboratable=no

"""A drawing by commands of the first firmware, on gateware with bowed lines."""

import json
from pathlib import Path

import numpy as np
import pytest

from fresa_host.errors import Refused
from tb.engines import CXXRTLEngine
from tb.machines.vplotter import MACHINE
from tb.mistake import Mistake
from tb.wall_plant import hanging
from tests.tools.draw.drawings import write
from tools.console import UserError
from tools.draw import __main__ as command
from tools.draw import bowed
from tools.draw.curves import Affine
from tools.draw.plan import Plan
from tools.draw.program import original, point_command, segments
from tools.draw.simulation import Drawn, settings_of
from tools.draw.timing import Speeds
from tools.draw.wall import Part, Placement, Wall

RATE = 2000
WALL, SPEEDS = Wall(400, 400, top=200, margin=20, rest=200 + 300j), Speeds(4000, 4000, 600)
OPTIONS = ["--wall", "400x400", "--margin", "20", "--rest", "200,300", "--width", "60", "--at",
           "170,205", "--rapid", "4000", "--acceleration", "600", "--string-rate", str(RATE)]
SETTINGS = settings_of(WALL, SPEEDS, RATE)
START, END = 100 + 220j, 300 + 250j


def planned(*lines) -> Plan:
    return Plan([Part("a", "#000000", [np.array(line, complex) for line in lines])], WALL,
                Placement(Affine(), 0j, 0j), [])


def rows(start: complex = START, end: complex = END, *, late: int = 0) -> np.ndarray:
    """Return what is seen of a line whose strings go as they should."""
    ends = [[round(abs(place - pulley) * SETTINGS.steps_of_string) for place in (start, end)]
            for pulley in (0, WALL.width)]
    most = max(abs(b - a) for a, b in ends)
    due = np.arange(1, most + 1)
    made = [a + np.sign(b - a) * ((most // 2 + due * abs(b - a)) // most) for a, b in ends]
    clocks = 5000 + SETTINGS.pace * np.arange(most)
    clocks[most // 2:] += late
    return np.stack([np.concatenate([[4999], clocks, clocks[-1:] + 1]),
                     *(np.concatenate([[a], way, way[-1:]])
                       for (a, _), way in zip(ends, made, strict=True))])


def drawn_of(seen: list[np.ndarray]) -> Drawn:
    return Drawn([hanging(each[1] / SETTINGS.steps_of_string, each[2] / SETTINGS.steps_of_string,
                          WALL.width) for each in seen], 8.5, (100, 200), None, 0, 0, 2_500_000,
                 31_250_000)


def bow(start: complex, end: complex) -> float:
    """Return how far the bow between two places is from their chord."""
    left, right = (np.linspace(abs(start - pulley), abs(end - pulley), 2001)
                   for pulley in (0, WALL.width))
    way = (hanging(left, right, WALL.width) - start) / (end - start)
    return float(np.abs(way.imag).max() * abs(end - start))


def test_the_machine_has_bowed_lines_at_the_rate():
    assert SETTINGS.bowed and SETTINGS.string_rate == RATE
    assert not settings_of(WALL, SPEEDS).bowed
    with pytest.raises(UserError, match="cannot be built: string_rate .by max_rate.* must be"):
        settings_of(WALL, Speeds(1000, 1000, 600), RATE)


def test_the_pieces_are_those_of_the_commands():
    plan = planned([10.2 + 20j, 30 + 20j, 30 + 39.6j], [5 + 5j, 5 + 5j])
    (part,) = plan.parts
    assert list(segments(part)) == [(10 + 20j, 30 + 20j), (30 + 20j, 30 + 40j), (5 + 5j, 5 + 5j)]
    assert original(part, WALL).split() == [
        ":P1", ":H", ":I00100020", ":F00300020", ":I00300020", ":F00300040", ":I00050005",
        ":F00050005", ":I02000300"]
    assert point_command("F", 1234 + 5j) == ":F12340005"


@pytest.mark.parametrize("ends", [(START, END), (END, START), (200 + 210j, 200 + 350j),
                                  (20 + 390j, 380 + 210j), (150 + 250j, 151 + 250j)])
def test_strings_at_constant_speed_are_the_ideal_bow(ends):
    off = bowed.bow_steps(np.array(ends), rows(*ends), SETTINGS)
    assert 0.5 <= off < bowed.ALLOWED_STEPS


def test_strings_that_go_otherwise_are_off():
    line = np.array([START, END])
    assert bowed.bow_steps(line, rows(late=2 * SETTINGS.pace), SETTINGS) > 2
    other = rows()
    other[2, len(other[2]) // 2:] += 2
    assert bowed.bow_steps(line, other, SETTINGS) > 2
    assert bowed.bow_steps(np.array([START, END + 1]), rows(), SETTINGS) > 10


def test_a_dot_is_no_bow():
    seen = np.array([[7, 8], [8000, 8000], [9000, 9000]])
    left, right = seen[1:, 0] / SETTINGS.steps_of_string
    place = complex(hanging(left, right, WALL.width))
    assert bowed.bow_steps(np.array([place, place]), seen, SETTINGS) < 1e-6


@pytest.fixture
def drawing(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write(tmp_path, '<rect width="90" height="40"/>')


@pytest.fixture
def pretended(drawing, monkeypatch):
    """Let the machine draw as it should, without an engine; return what is changed of that."""
    change = {}
    monkeypatch.setattr("tb.engines.choose", lambda name: None)

    def draw(plan, settings):
        if "error" in change:
            raise change["error"]
        seen = [rows(*each, late=change.get("late", 0))
                for part in plan.parts for each in segments(part)][change.get("lost", 0):]
        return bowed.compared(plan, settings, drawn_of(seen), seen)

    monkeypatch.setattr(bowed, "simulated", draw)
    return change


def run(*arguments: object) -> int:
    return command.main(["drawing.svg", *OPTIONS, "--sort", "own", "--effort", "0.1", "--bowed",
                         *map(str, arguments)])


def test_what_is_said_and_written(pretended, capsys):
    assert run("--simulate", "--json", "a.json", "--png", "a.png") == 0
    facts = json.loads(Path("a.json").read_text())["simulated"]
    assert facts["right"] and facts["bowed"] and facts["lines"] == facts["lines_drawn"] == 4
    assert facts["deviation_mm"] > 0.5 and facts["deviation_allowed_mm"] is None
    assert facts["bow_steps"] <= facts["bow_steps_allowed"]
    out = capsys.readouterr().out
    assert f"simulated: bowed by at most {facts['deviation_mm']:.3f} mm, at " in out
    assert "simulated: at most 1.2" in out and "half steps of a string off the bows" in out
    assert "WRONG" not in out and Path("a.png").stat().st_size > 1000


@pytest.mark.parametrize(("change", "message"), [
    ({"late": 2000}, "half steps off the bow; 1.75 are what rounding explains"),
    ({"lost": 1}, "3 lines were drawn, not 4")])
def test_what_is_wrong_is_said(pretended, capsys, change, message):
    pretended.update(change)
    assert run("--simulate") == 1
    assert message in capsys.readouterr().out


def test_a_machine_that_gives_up_is_said(pretended, capsys):
    pretended["error"] = Refused(":F00000000", "Off the wall")
    assert run("--simulate", "--out", "a.gcode") == 1
    assert capsys.readouterr().out.startswith("simulated: ") and not Path("a.gcode").exists()


@pytest.mark.parametrize(("arguments", "message"), [
    (["--bowed"], "--bowed is how --simulate draws"),
    (["--bowed", "--simulate", "--to", "/dev/no-such-port"], "--to sends G-code"),
    (["--bowed", "--simulate", "--dwell", "0.1"], "which have no --dwell"),
    (["--simulate", "--string-rate", "500"], "--string-rate is that of --bowed"),
    (["--bowed", "--simulate", "--string-rate", "0"], "whole number from 1 to 4000"),
    (["--bowed", "--simulate", "--string-rate", "3000"], "cannot be built: string_rate"),
])
def test_what_makes_no_sense_is_refused(drawing, monkeypatch, capsys, arguments, message):
    monkeypatch.setattr("tb.engines.choose", lambda name: None)
    assert command.main(["drawing.svg", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


@pytest.mark.compiler
@pytest.mark.long
class TestOnTheGateware:
    """All on one machine, which is compiled once, but for that with a mistake."""

    def test_lines_are_bowed_as_they_should_be(self):
        found = bowed.simulated(planned([START, END], [300 + 300j, 300 + 300j]), SETTINGS)
        assert found.right and found.steps < bowed.ALLOWED_STEPS
        assert found.comparison.worst == pytest.approx(bow(START, END), abs=0.1)
        assert [len(line) > 1 for line in found.drawn.lines] == [True, False]

    def test_a_drawing(self, drawing, capsys):
        assert run("--simulate", "--json", "a.json", "--png", "a.png") == 0
        done = json.loads(Path("a.json").read_text())["simulated"]
        assert done["right"] and done["lines_drawn"] == 4 and done["pauses"] == 0
        assert 0.5 < done["deviation_mm"] < 3

    def test_a_line_off_the_wall_is_refused(self):
        with pytest.raises(Refused, match="Off the wall"):
            bowed.simulated(planned([START, 300 + 100j]), SETTINGS)

    def test_a_mistake_is_found(self, monkeypatch):
        """The motor with fewer steps makes its own as soon as the other one."""
        wrong = Mistake("homing.line.sum_right", lambda right, at: at("homing.line.most"))
        monkeypatch.setattr(bowed, "build", lambda settings: CXXRTLEngine(
            wrong.planted(MACHINE.design(settings=settings)), stretches=True))
        found = bowed.simulated(planned([START, END]), SETTINGS)
        assert not found.right and found.steps > 3 and found.drawn.sound
