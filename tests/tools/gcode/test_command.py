"""The command that runs a program of G-code on the gateware, and draws it."""

import io
import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fresa_host.gcode_lines import ERRORS, Message
from tb.machine import Machine
from tests.vcd import read_changes
from tools.gcode import __main__ as command
from tools.gcode.job import WINDOW_S

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


@pytest.fixture(scope="module")
def elaborated_once():
    """Elaborate the machine of all tests once: that takes more than what they do with it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Machine, "design", cache(Machine.design))
        yield


@pytest.mark.compiler
@pytest.mark.usefixtures("elaborated_once")
class TestGateware:
    def test_a_program(self, tmp_path, program, capsys):
        files = {kind: tmp_path / f"part.{kind}" for kind in ("png", "json", "vcd")}
        assert run(program, *MACHINE, "--png", files["png"], "--json", files["json"], "--vcd",
                   files["vcd"]) == 0
        printed = capsys.readouterr()
        assert "5 lines of G-code" in printed.out and "in 3 parts" in printed.out
        assert "started again 1 time;" in printed.out
        assert printed.out.count("wrote ") == 3 and "will have some" in printed.err
        facts = json.loads(files["json"].read_text())
        assert facts["steps"] == {"x": 2 * 4 * 80 + 2 * 80, "y": 4 * 40, "z": 250}
        assert facts["right"] and facts["end_steps"] == [0, 0, 0] and facts["pauses"] == 1
        assert facts["deviation_steps"] < 1
        assert facts["made_mm"] == pytest.approx(facts["asked_mm"], rel=0.01)
        length = 17.25 ** 0.5  # of the way back, half of which it speeds up, as X allows
        highest = (1000 * length / 4 * length) ** 0.5
        seen = highest - 1000 * length / 4 * WINDOW_S / 4  # the mean of a peak
        assert facts["top_speed_mm_min"] == pytest.approx(60 * seen, rel=0.01)
        assert 0.3 < facts["seconds"] < 1
        wave = read_changes(files["vcd"])
        assert sum(value == "1" for _, value in wave["step_z"]) == 250
        with Image.open(files["png"]) as image:
            assert image.size[0] == 1200

    @pytest.mark.long
    def test_pins_that_are_inverted(self, tmp_path, program):
        assert run(program, *MACHINE, "--settings", "2=6,3=5,5=1,202=7", "--json",
                   tmp_path / "a.json") == 0
        facts = json.loads((tmp_path / "a.json").read_text())
        assert facts["steps"] == {"x": 2 * 4 * 80 + 2 * 80, "y": 4 * 40, "z": 250}

    def test_from_standard_input(self, monkeypatch, capsys):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"G91 G0 X.1\r\nX-.1\r\n")))
        assert run("-", *MACHINE) == 0
        assert "2 lines of G-code, a path of 0.2 mm in 2 parts" in capsys.readouterr().out

    def test_without_standard_input(self, monkeypatch, capsys):
        monkeypatch.setattr("sys.stdin", None)
        assert run("-", *MACHINE) == 2
        assert "there is no standard input to read: give a file" in capsys.readouterr().err

    def test_a_line_that_is_refused(self, tmp_path, program, capsys):
        program.write_text(PROGRAM.replace("M0", bad := "G2 X9 I1"))
        before = sorted(tmp_path.iterdir())
        assert run(program, *MACHINE, "--png", tmp_path / "a.png", "--vcd", tmp_path / "a.vcd") == 1
        out = capsys.readouterr().out
        assert out == f"{program}, line 7: {ERRORS[33]} (error:33)\n    {bad}\n"
        assert sorted(tmp_path.iterdir()) == before

    def test_control_c_leaves_nothing(self, tmp_path, program, monkeypatch, capsys):
        def interrupted(*_, **__):
            raise KeyboardInterrupt

        monkeypatch.setattr("tools.gcode.sender.GCodeSession.stream", interrupted)
        before = sorted(tmp_path.iterdir())
        assert run(program, *MACHINE, "--png", tmp_path / "a.png", "--vcd", tmp_path / "a.vcd"
                   ) == 130
        assert sorted(tmp_path.iterdir()) == before

    def test_steps_that_are_lost_are_wrong(self, program, monkeypatch, capsys):
        program.write_text("G91 G0 X0.2\nY0.3")
        steps = command.Simulation.steps

        def lossy(simulation):
            found = steps(simulation)
            found.change[np.flatnonzero(found.change[:, 0])[:9]] = 0
            return found

        monkeypatch.setattr(command.Simulation, "steps", lossy)
        assert run(program, *MACHINE) == 1
        assert "WRONG: at most " in capsys.readouterr().out

    @pytest.mark.long
    def test_a_second_motor_makes_the_steps_of_the_first_one(
            self, tmp_path, program, monkeypatch, capsys):
        program.write_text("G91 G1 X1 Y-0.5 F3000\nY0.3\n")
        gantry = (program, *MACHINE, "--second-motor", "y")
        assert run(*gantry, "--settings", "2=2,3=10,5=1", "--json", tmp_path / "a.json",
                   "--vcd", tmp_path / "a.vcd") == 0
        assert "the two motors of y made all steps together" in capsys.readouterr().out
        facts = json.loads((tmp_path / "a.json").read_text())
        assert (facts["second_motor"], facts["steps_apart"]) == ("y", 0)
        wave = read_changes(tmp_path / "a.vcd")
        assert wave["second_step"] == wave["step_y"] and len(wave["step_y"]) == 2 * 32 + 1

        take = command.Simulation._take

        def lossy(simulation, clocks, rows):
            rows["second_step"] &= ~rows["moving"] | rows["step"] & 1
            return take(simulation, clocks, rows)

        monkeypatch.setattr(command.Simulation, "_take", lossy)
        assert run(*gantry) == 1
        assert "WRONG: the two motors of y made " in capsys.readouterr().out

    def test_an_alarm(self, program, monkeypatch, capsys):
        session = "tools.gcode.sender.GCodeSession"
        monkeypatch.setattr(f"{session}.stream", lambda self, blocks: (
            self._take(Message("alarm", "ALARM:1", 1)), self._check(), (yield 0)))
        assert run(program, *MACHINE) == 1
        assert "ALARM:1: a limit switch was hit" in capsys.readouterr().out


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
        (["good", "--rate", "1.2e5", "1", "1"], "max_rate of X must be at most"),
        (["good", "--clock", "2500000", "--baud", "1000000"], "baud at a clock of 2500000 Hz"),
        (["homes"], "line 2: the path behind '$H' is not known here"),
        (["sets"], "line 1: the path behind '$100=80' is not known here"),
        (["probes"], "line 1: the path behind 'G38.3 Z-1 F60' is not known here"),
        (["good", "--settings", "22"], "--settings must be such as 22=1,130=300, not '22'"),
        (["good", "--settings", "100=80"], "$100 has a setting of its own"),
        (["good", "--settings", "221=0.1"], "leave $220 to $222 out"),
        (["good", "--dialect", "thesis"], "unrecognized arguments: --dialect thesis"),
        (["good", "--settings", "22=1,22=0"], "--settings has $22 twice"),
        (["good", "--settings", f"22={'9' * 400}.5"], "--settings must be such as"),
        (["good", "--settings", "11=1e5000"], "--settings must be such as"),
        (["good", "--steps", "1e5000", "1", "1"], "--steps must be a number such as"),
        (["good", "--depth", "65"], "depth must be a power of two, not 65"),
        (["checks"], "line 1: the path behind '$c' is not known here"),
        (["homes_one"], "line 1: the path behind '$HX' is not known here"),
        (["good", "--settings", "20=1"], "$20, soft limits, needs $22, homing"),
        (["good", "--clock", "1"], "must be a whole number from 2000000"),
        ([], "the following arguments are required: FILE"),
    ])
    def test_in_one_line(self, tmp_path, monkeypatch, capsys, arguments, message):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(command, "_build", None)  # never called
        for name, data in (("binary", b"G1\0X1"), ("empty", b""), ("comments", b"%\n(G1)\n;\n"),
                           ("good", b"G0 X1\n"), ("homes", b"$X\n$H\n"), ("sets", b"$100=80\n"),
                           ("probes", b"G38.3 Z-1 F60\n"), ("checks", b"$c\nG0 X1\n"),
                           ("homes_one", b"$HX\n")):
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
    assert clock(baud=1_000_000) == 20_000_000
    assert clock(steps=("1600",) * 3, rate=("16000",) * 3, width_ns=100, low_ns=100) == 5_000_000
