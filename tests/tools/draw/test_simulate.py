"""A drawing on the gateware: the pen draws it, and what is wrong is found."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fresa_host.gcode_lines import BlockRefused
from tests.tools.draw.drawings import write
from tools.console import UserError
from tools.draw import __main__ as command
from tools.draw import program, simulated, simulation
from tools.draw.curves import Affine
from tools.draw.plan import Plan, plan
from tools.draw.simulation import Drawn, settings_of, string_steps
from tools.draw.svg import read_drawing
from tools.draw.timing import Speeds
from tools.draw.wall import Part, Placement, Wall
from tools.gcode.sender import FaultShown

DRAWING = """
    <g inkscape:groupmode="layer" inkscape:label="Box"><rect x="5" y="5" width="90" height="40"/>
      <path d="M10,10 L90,40" stroke="black"/></g>
    <g inkscape:groupmode="layer" inkscape:label="Round"><circle cx="50" cy="75" r="20"/>
      <path d="M50,75 h0.0001" stroke="black"/></g>"""
OPTIONS = ["--wall", "400x400", "--margin", "20", "--rest", "200,300", "--width", "60", "--at",
           "170,205", "--feed", "4000", "--rapid", "4000", "--acceleration", "600"]
WALL, SPEEDS = Wall(400, 400, top=200, margin=20, rest=200 + 300j), Speeds(4000, 4000, 600)


@pytest.fixture
def drawing(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write(tmp_path, DRAWING)


@pytest.fixture
def planned(drawing):
    return plan(read_drawing(drawing), WALL, width=60, at=170 + 205j, effort=0.1, vpype=False)


@pytest.fixture
def right(planned, monkeypatch):
    """Let the machine draw what is asked for, without an engine; return what it has drawn."""
    made = Drawn(list(planned.lines), 12.5, (100, 200), None, 0, 1, 2_500_000, 31_250_000)
    monkeypatch.setattr("tb.engines.choose", lambda name: None)
    done = Pretended(planned, made)
    monkeypatch.setattr(simulated, "simulated", done)
    return done


class Pretended:
    """Stands for a simulation."""

    def __init__(self, planned, drawn):
        self.planned, self.drawn = planned, drawn

    def __call__(self, planned, settings, speeds):
        if isinstance(self.drawn, Exception):
            raise self.drawn
        return simulated.compared(planned, settings, speeds, self.drawn)


def run(*arguments: object) -> int:
    return command.main([str(each) for each in (
        "drawing.svg", *OPTIONS, "--sort", "own", "--effort", "0.1", *arguments)])


def test_the_machine_is_that_of_the_options():
    settings = settings_of(Wall(1000, 900, top=150, rest=400 + 500j), Speeds(1800, 240.5, 80))
    assert (settings.wall_width, settings.wall_height, settings.least_y) == (1000, 900, 150)
    assert settings.rest == (400, 500) and settings.acceleration[:2] == (80, 80)
    assert [float(rate) for rate in settings.max_rate[:2]] == [240.5, 240.5]
    assert settings.clock == 2_500_000 and settings.bit == 16
    assert settings.string_rate < 400  # no faster than its strings may go


@pytest.mark.parametrize(("wall", "message"), [
    (Wall(1000.5, 900), "takes whole mm, .* --wall is 1000.5"),
    (Wall(1001, 900), "takes whole mm, .* --rest is 500.5"),
    (Wall(1000, 900, top=0), "cannot be built: least_y in mm must be"),
    (Wall(1000, 900, top=99.5), "--top is 99.5"),
    (Wall(9000, 9000), "with 25.4648 half steps a mm .* a wall may be 2573 mm wide"),
])
def test_a_machine_that_cannot_be_built_is_refused(wall, message):
    with pytest.raises(UserError, match=message):
        settings_of(wall, SPEEDS)


def test_what_is_said_and_written(right, capsys):
    assert run("--simulate", "--png", "a.png", "--json", "a.json") == 0
    out = capsys.readouterr().out
    assert "simulated: at most 0.000 mm off the drawing, at " in out
    assert "simulated: 12.5 s on the machine; steps of the strings: left 100, right 200" in out
    facts = json.loads(Path("a.json").read_text())["simulated"]
    assert facts["right"] and facts["lines_drawn"] == 4 and facts["seconds"] == 12.5
    assert facts["steps"] == {"left": 100, "right": 200} and facts["torn_at_mm"] is None
    assert Path("a.png").stat().st_size > 1000


@pytest.mark.parametrize(("change", "message"), [
    ({"torn": 3 + 4j}, "the strings are torn, at 3.0,4.0"),
    ({"jumps": 2}, "no motor can follow 2 of the coil words"),
    ({"lines": []}, "0 lines were drawn, not 4"),
])
def test_what_is_wrong_is_said_and_nothing_is_sent(right, capsys, change, message):
    right.drawn = replace(right.drawn, **change)
    assert run("--simulate", "--to", "/dev/no-such-port", "--json", "a.json", "--png",
               "a.png") == 1
    assert f"WRONG: {message}" in capsys.readouterr().out
    assert not json.loads(Path("a.json").read_text())["simulated"]["right"]


def test_a_place_that_is_off_is_said(right, capsys):
    lines = [line.copy() for line in right.drawn.lines]
    lines[1][0] += 1
    right.drawn = replace(right.drawn, lines=lines)
    assert run("--simulate") == 1
    out = capsys.readouterr().out
    assert "mm farther off than steps of the strings explain" in out
    assert "simulated: at most 1.000 mm off" in out and "in line 2\n" in out


@pytest.mark.parametrize("error", [FaultShown("the machine shows a fault at clock 7"),
                                   BlockRefused(33, "G1 X5", 12)])
def test_a_machine_that_gives_up_is_said_and_nothing_is_written(right, capsys, error):
    right.drawn = error
    assert run("--simulate", "--out", "a.gcode") == 1
    assert capsys.readouterr().out == f"simulated: {error}\n"
    assert not Path("a.gcode").exists()


def test_without_a_compiler_it_says_what_to_install(drawing, monkeypatch, capsys):
    monkeypatch.setattr("tb.engines.CXXRTLEngine.missing", lambda: "no compiler: install one")
    assert run("--simulate", "--out", "a.gcode") == 2
    assert capsys.readouterr().err == "error: no compiler: install one\n"
    assert not Path("a.gcode").exists()


@pytest.mark.compiler
@pytest.mark.long
class TestOnTheGateware:
    """All on one machine, which is compiled once: that takes a minute."""

    def test_it_draws_what_is_asked_for(self, drawing, planned, capsys):
        assert run("--simulate", "--json", "a.json", "--png", "a.png") == 0
        facts = json.loads(Path("a.json").read_text())
        done = facts["simulated"]
        assert done["right"] and done["lines_drawn"] == facts["lines"] == 4
        assert 0.01 < done["deviation_mm"] < 0.1 + 0.5 / 25.4648
        assert done["seconds"] == pytest.approx(facts["seconds"], rel=0.2)
        assert done["pauses"] == 1
        steps = sum(done["steps"].values())
        assert steps == pytest.approx(string_steps(planned, settings_of(WALL, SPEEDS)), rel=0.03)
        assert "WRONG" not in capsys.readouterr().out

    def test_lines_that_meet_and_dots(self):
        lines = [np.array(line, complex) for line in (
            [200 + 300j, 210 + 300j], [210 + 300j, 210 + 310j], [210 + 310j, 210 + 310j],
            [190 + 290j, 190 + 290j], [180 + 290j, 180.5 + 290j])]
        for dwell, count in (0.0, 3), (0.05, 5):
            done = simulated.simulated(
                Plan([Part("a", "#000000", lines)], WALL, Placement(Affine(), 0j, 0j), []),
                settings_of(WALL, SPEEDS), SPEEDS._replace(dwell=dwell))
            assert done.right and len(done.drawn.lines) == count

    def test_a_wall_of_another_width_is_found(self, planned):
        done = simulated.simulated(planned, settings_of(WALL, SPEEDS), SPEEDS, width=408)
        assert not done.right and done.comparison.worst > 3 and done.drawn.sound
        assert done.comparison.drawn == 4
        assert all(np.abs(np.diff(line)).max(initial=0) < 0.2 for line in done.drawn.lines)

    def test_strings_that_do_not_reach_are_torn(self, planned):
        done = simulated.simulated(planned, settings_of(WALL, SPEEDS), SPEEDS, width=640)
        assert done.drawn.torn is not None and not done.right

    @pytest.mark.parametrize(("old", "new", "message"), [
        ("M3 S1000", "(M3)", "3 lines were drawn, not 4"),
        ("M5\n(pen 1", "M5\nM3\nG4 P0.1\nM5\n(pen 1", "5 lines were drawn, not 4"),
    ])
    def test_a_line_that_is_missing_or_too_much_is_found(
            self, drawing, monkeypatch, capsys, old, new, message):
        monkeypatch.setattr(simulation, "gcode", lambda *given: program.gcode(*given).replace(
            old, new, 1))
        assert run("--simulate") == 1
        assert f"WRONG: {message}" in capsys.readouterr().out

    def test_a_line_that_it_refuses_ends_it(self, drawing, monkeypatch, capsys):
        monkeypatch.setattr(simulation, "gcode", lambda *given: "G21\nG1 X-5 F100\n")
        assert run("--simulate", "--png", "a.png") == 1
        assert capsys.readouterr().out.startswith("simulated: ")
        assert not Path("a.png").exists()
