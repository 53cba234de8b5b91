# amaranth: UnusedElaboratable=no

"""What people choose when `gcode` is built: what is taken, and one line about what is not."""

import re
from pathlib import Path

import pytest

from fresa.machines.gcode import GCode, GCodeSettings
from fresa.protocol import SETTINGS
from fresa.protocol.stored_program import MAX_PROGRAM
from tb.machines.gcode import MACHINE

DEFAULTS = {option.name: option.default for option in MACHINE.options}


def settings(**chosen):
    return MACHINE.real(50_000_000, **{**DEFAULTS, **chosen})["settings"]


@pytest.mark.parametrize(("chosen", "message"), [
    ({"kinematics": "delta"}, "kinematics must be cartesian or corexy, not 'delta'"),
    ({"kinematics": "corexy", "steps": ("80", "100", "400")},
     "X and Y of corexy must have the same steps per mm"),
    ({"second_motor": "a"}, "second_motor must be one of x, y, z, not 'a'"),
    ({"second_motor": "y", "kinematics": "corexy"},
     "with corexy only z may have a second motor, not y: X and Y have no motors of their own"),
    ({"second_motor": "y", "dialect": "thesis"},
     "the dialect of the thesis has no second motor: its homing cycle squares no gantry"),
    ({"settings": "3=8"}, "$3 must be a whole number from 0 to 7, not 8"),
    ({"second_motor": "y", "settings": "3=16"}, "$3 must be a whole number from 0 to 15, not 16"),
    ({"pwm_hz": 60_000}, "frequency of the PWM must be a whole number from 1 to 48828, not 60000"),
    ({"settings": "201=0"}, "$201 must be a whole number from 1 to 5000, not 0"),
    ({"settings": "211=5000"}, "$211 must be a whole number from 1 to 4000, not 5000")])
def test_impossible_machines(chosen, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        settings(**chosen)


@pytest.mark.parametrize(("chosen", "message"), [
    ({"silence_us": 0}, "silence_us must be a whole number from 1 to 1342177, not 0"),
    ({"idle_us": 1_342_178}, "idle_us must be a whole number from 1 to 1342177, not 1342178"),
    ({"servo_us": 20_001}, "servo_us must be a whole number from 18 to 20000, not 20001")])
def test_impossible_times(chosen, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        GCodeSettings(**chosen)


def test_arcs_of_a_program_are_of_the_steps_of_the_machine(tmp_path):
    program = tmp_path / "arc.ngc"
    program.write_text("G2 X0 J3000 F600\n")
    assert settings(program=str(program)).program
    for chosen in {"program": str(program)}, {"startup": ("G2 X0 J3000 F600", "")}:
        with pytest.raises(ValueError, match="refuse 'G2 X0 J3000 F600' with error:33"):
            settings(steps=("800", "80", "80"), **chosen)


def test_startup_lines_are_those_that_the_machine_would_keep():
    kept = settings(startup=("g21 (mm) f600", "G1 X0.5 ; a bit"))
    assert kept.startup == ("G21F600", "G1X0.5")
    assert settings(startup=("", "")).startup == ()
    assert settings().stores and not settings(startup_lines="no").stores
    for lines, message in ((("G1X1", "F600"), "refuse 'G1X1' with error:22"),
                           (("G999", ""), "refuse 'G999' with error:20"),
                           (("X" + "0" * 126, "X" + "0" * 127), "characters of startup line 1")):
        with pytest.raises(ValueError, match=message):
            settings(startup=lines)
    with pytest.raises(ValueError, match="no room for startup lines"):
        settings(startup=("G21", ""), startup_lines="no")


def test_a_program_comes_behind_the_startup_lines(tmp_path):
    program = tmp_path / "program.ngc"
    program.write_text("G1X1\n")
    with pytest.raises(ValueError, match="error:22"):
        settings(program=str(program))
    assert settings(program=str(program), startup=("F600", "")).program == b"G1X1\n"


def test_two_axes_may_ask_a_motor_for_steps_at_once():
    assert settings(kinematics="corexy").most_rate == settings().most_rate / 2
    with pytest.raises(ValueError, match="max_rate of X must be at most"):
        settings(kinematics="corexy", rate=("60000", "500", "500"))
    settings(rate=("60000", "500", "500"))


def test_a_second_motor_may_be_on_any_axis_and_on_z_of_corexy():
    for axis in "xyz":
        assert settings(second_motor=axis, settings="3=15").second_motor == axis
    assert settings(second_motor="z", kinematics="corexy").second_axis == 2


def test_ports_of_a_second_motor_are_there_with_it_alone():
    given, without = (GCode(settings=settings(second_motor=axis)) for axis in ("x", None))
    further = {"second_step", "second_direction", "second_limit"}
    assert given.signature.members.keys() - without.signature.members.keys() == further
    assert without.signature.members.keys() == without.roles.keys()
    assert given.signature.members.keys() == given.roles.keys()


class TestProgram:
    def program(self, path: Path, text: bytes) -> bytes:
        path.write_bytes(text)
        return settings(program=str(path)).program

    def test_is_stored_without_comments_and_empty_lines(self, tmp_path):
        text = b"%\r\n$H\nG21 (Hell\xc3\xb6!) G90 ; all\n\n\tG0 X1\nM30"
        assert self.program(tmp_path / "p.ngc", text) == b"$H\nG21  G90\nG0 X1\nM30\n"

    @pytest.mark.parametrize(("text", "says"), [
        (b"G21\nG1 X1\n", ", line 2: the machine would refuse 'G1 X1' with error:22"),
        (b"G21 (\xc3\xa9)\nG0 X1\xff\n", ", line 2: 'ÿ' may not be in a line"),
        (b"G0 X1!\n", ", line 1: the machine would refuse 'G0 X1!' with error:"),
        (b"G0 X\x01\n", ", line 1: '\\x01' may not be in a line"),
        (b"(nothing)\n", " has 0 bytes without comments: from 1 to 65536 can be stored"),
        (b"G0 X1\n" * (MAX_PROGRAM // 6 + 1), f" has {MAX_PROGRAM // 6 * 6 + 6} bytes")])
    def test_what_cannot_be_one_is_one_line(self, tmp_path, text, says):
        with pytest.raises(ValueError, match=re.escape(f"--program {tmp_path / 'p.ngc'}{says}")):
            self.program(tmp_path / "p.ngc", text)

    def test_that_of_the_thesis_has_its_dialect(self, tmp_path):
        text = b"G28\nG92\nG1 X1 F100\nG4 P200\nM5\n"
        (tmp_path / "p.ngc").write_bytes(text)
        made = settings(program=str(tmp_path / "p.ngc"), dialect="thesis")
        assert made.program == text
        (tmp_path / "p.ngc").write_bytes(b"G28\nG21\n")
        with pytest.raises(ValueError, match="line 2: .*G21. with error:20"):
            settings(program=str(tmp_path / "p.ngc"), dialect="thesis")

    def test_a_file_that_is_not_there(self, tmp_path):
        with pytest.raises(ValueError, match="cannot be read: No such file"):
            settings(program=str(tmp_path / "none"))


def test_each_setting_of_a_machine_is_on_the_page():
    page = (Path(__file__).parents[2] / "docs" / "gcode.md").read_text()
    table = page[page.index("## Settings"):page.index("## Homing")]
    listed = set()
    for first, between, last in re.findall(r"`\$(\d+)`(?:( to |, )`\$(\d+)`)?", table):
        listed |= set(range(int(first), int(last) + 1)) if between == " to " else {
            int(each) for each in (first, last) if each}
    assert {each.number for each in SETTINGS} <= listed
