"""The command that runs a program of G-code on the gateware, and draws it."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fresa_host.gcode_lines import Message
from tests.vcd import read_changes
from tools.gcode import __main__ as command
from tools.gcode.picture import ASKED

# Those of tests/hdl/machines/test_gcode.py, so that the machine is compiled once for both.
MACHINE = ("--baud 125000 --steps 80 40 250 --rate 6000 6000 6000 --acceleration 1000 1000 1000"
           ).split()
PROGRAM = """\
%
(a line, half a circle in the air, a pause)
G21 G90
G1 X4 Y-1 F3000   ; feed
g3 x4 y1 j1 z0.5

M0
G0 X0 Y0 Z0
"""


@pytest.fixture
def program(tmp_path) -> Path:
    path = tmp_path / "part.ngc"
    path.write_text(PROGRAM)
    return path


def run(*arguments: object) -> int:
    return command.main([str(each) for each in arguments])


@pytest.mark.compiler
class TestGateware:
    def test_a_program(self, tmp_path, program, capsys):
        files = {kind: tmp_path / f"part.{kind}" for kind in ("png", "json", "vcd")}
        assert run(program, *MACHINE, "--png", files["png"], "--json", files["json"], "--vcd",
                   files["vcd"]) == 0
        printed = capsys.readouterr()
        assert "5 lines, 3 lines and arcs" in printed.out and "1 pauses ended" in printed.out
        assert printed.out.count("wrote ") == 3 and "will have some" in printed.err
        facts = json.loads(files["json"].read_text())
        assert facts["steps"] == {"x": 2 * 4 * 80 + 2 * 80, "y": 4 * 40, "z": 250}
        assert facts["right"] and facts["end_steps"] == [0, 0, 0] and facts["pauses"] == 1
        assert facts["deviation_steps"] < 1
        assert facts["made_mm"] == pytest.approx(facts["asked_mm"], rel=0.01)
        assert facts["top_speed_mm_min"] == pytest.approx(6000 * (17.25 / 16) ** 0.5, rel=0.2)
        assert 0.3 < facts["seconds"] < 1
        wave = read_changes(files["vcd"])
        assert sum(value == "1" for _, value in wave["step_z"]) == 250
        assert ASKED in {colour for _, colour in
                         Image.open(files["png"]).convert("RGB").getcolors(1 << 20) or []}

    def test_from_standard_input_on_a_machine_whose_axes_are_finer(self, monkeypatch, capsys):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"G91 G0 X.1\r\nX-.1\r\n")))
        assert run("-", *MACHINE) == 0
        assert "2 lines, 2 lines and arcs, 0.2 mm" in capsys.readouterr().out

    @pytest.mark.parametrize(("bad", "why"), [
        ("G1 X1 X2", "a letter is there twice (error:25)"),
        ("G2 X9 I1", "the target cannot be: the arc's radii differ, say, or it is out of reach"),
        ("G5 X1", "there is no such command (error:20)"),
    ])
    def test_a_line_that_is_refused(self, tmp_path, program, capsys, bad, why):
        program.write_text(PROGRAM.replace("M0", bad))
        before = sorted(tmp_path.iterdir())
        assert run(program, *MACHINE, "--png", tmp_path / "a.png", "--vcd", tmp_path / "a.vcd") == 1
        out = capsys.readouterr().out
        assert out.startswith(f"{program}, line 7: {why}") and out.endswith(f"    {bad}\n")
        assert sorted(tmp_path.iterdir()) == before

    def test_control_c_leaves_nothing(self, tmp_path, program, monkeypatch, capsys):
        def interrupted(*_, **__):
            raise KeyboardInterrupt

        monkeypatch.setattr("tools.gcode.simulation.GCodeSession.stream", interrupted)
        before = sorted(tmp_path.iterdir())
        assert run(program, *MACHINE, "--png", tmp_path / "a.png", "--vcd", tmp_path / "a.vcd"
                   ) == 130
        assert sorted(tmp_path.iterdir()) == before

    def test_a_step_that_is_lost_is_wrong(self, program, monkeypatch, capsys):
        steps = command.Simulation.steps

        def lossy(simulation):
            found = steps(simulation)
            found.change[np.flatnonzero(found.change[:, 0])[:9]] = 0
            return found

        monkeypatch.setattr(command.Simulation, "steps", lossy)
        assert run(program, *MACHINE) == 1
        assert "WRONG: at most " in capsys.readouterr().out

    def test_an_alarm(self, program, monkeypatch, capsys):
        session = "tools.gcode.simulation.GCodeSession"
        monkeypatch.setattr(f"{session}.stream", lambda self, blocks: (
            self._take(Message("alarm", "ALARM:1", 1)), self._check(), (yield 0)))
        assert run(program, *MACHINE) == 1
        assert "ALARM:1: a limit switch was hit" in capsys.readouterr().out

    def test_without_an_extent(self, tmp_path, capsys):
        """Nothing moves, or one axis does: it is drawn all the same."""
        for name, text in (("none", "G4 P0.05"), ("up", "G0 Z1"), ("across", "G0 X1")):
            (tmp_path / name).write_text(text)
            assert run(tmp_path / name, *MACHINE, "--png", tmp_path / f"{name}.png") == 0
        heights = [Image.open(tmp_path / f"{name}.png").height for name in ("none", "up", "across")]
        assert heights[1] > heights[0] and heights[0] == heights[2]


class TestWrong:
    @pytest.mark.parametrize(("arguments", "message"), [
        (["none.ngc"], "none.ngc: No such file or directory"),
        (["."], "Is a directory"),
        (["binary"], "binary is no program: it is not text"),
        (["empty"], "there is no line of G-code in empty"),
        (["comments"], "there is no line of G-code in comments"),
        (["good", "--png", "good.jpg"], "would be a PNG file"),
        (["good", "--json", "good"], "good is what is read"),
        (["good", "--vcd", "no/a.vcd"], "its folder does not exist"),
        (["good", "--steps", "0", "1", "1"], "--steps must be above 0"),
        (["good", "--steps", "1", "1"], "expected 3 arguments"),
        (["good", "--rate", "9e9", "1", "1"], "max_rate of X must be at most"),
        (["good", "--clock", "2500000", "--baud", "1000000"], "baud at a clock of 2500000 Hz"),
        (["good", "--clock", "1"], "must be a whole number from 2000000"),
        ([], "the following arguments are required: FILE"),
    ])
    def test_in_one_line(self, tmp_path, monkeypatch, capsys, arguments, message):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(command, "_build", None)  # never called
        for name, data in (("binary", b"G1\0X1"), ("empty", b""), ("comments", b"%\n(G1)\n;\n"),
                           ("good", b"G0 X1\n")):
            Path(name).write_bytes(data)
        before = sorted(tmp_path.iterdir())
        assert run(*arguments) == 2
        out, err = capsys.readouterr()
        assert not out and err.count("\n") == 1 and message in err
        assert sorted(tmp_path.iterdir()) == before

    @pytest.mark.parametrize(("line", "message"), [
        ("G0 X1!", "'!' may not be in a line"), ("G0 X1 ä", "'ä' may not be in a line"),
        ("G1 " + "X1" * 70, "at most 126 characters"),
    ])
    def test_a_line_that_cannot_be_sent(self, tmp_path, monkeypatch, capsys, line, message):
        monkeypatch.setattr(command, "_build", None)
        (tmp_path / "part.ngc").write_text(f"G0 X1\n{line}\n")
        assert run(tmp_path / "part.ngc") == 1
        out = capsys.readouterr().out
        assert "part.ngc, line 2: " in out and message in out and out.count("\n") == 1

    def test_too_long(self, tmp_path, monkeypatch, capsys):
        monkeypatch.setattr(command, "LARGEST", 4)
        (tmp_path / "part.ngc").write_text("G0 X1")
        assert run(tmp_path / "part.ngc") == 2
        assert "cut it into parts" in capsys.readouterr().err


def test_the_clock_is_as_low_as_can_be():
    def clock(**values):
        return command._settings(None, {**{option.name: option.default for option in
                                           command.MACHINE.options}, **values}).clock

    assert clock() == 2_500_000
    assert clock(baud=1_000_000) == 25_000_000
    assert clock(steps=("1600",) * 3, rate=("16000",) * 3, width_ns=100, low_ns=100) == 5_000_000
