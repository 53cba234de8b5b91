# amaranth: UnusedElaboratable=no

"""Whole sessions with the gateware of `gcode`."""

import argparse
import re
import threading
import time
from collections.abc import Iterator

import pytest

from fresa_boards.boards import BOARDS
from fresa_host import BlockRefused, GCode, JobStopped
from tests.tools.process import PATIENCE, ROOT, running
from tools.console import UserError
from tools.serve import build, servable

serial = pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")


def test_a_second_motor_has_a_switch_with_an_input_of_its_own():
    served, parser = servable()["gcode"], argparse.ArgumentParser()
    served.add_options(parser.add_argument_group())
    assert served.chosen(parser.parse_args([])).further_switches == {}
    gantry = served.chosen(parser.parse_args(["--second-motor", "y"]))
    assert gantry.switches == ("X-", "Y-", "Z-")
    assert gantry.further_switches == {"Y2-": "second_limit"}
    assert {"second_limit"} < set(gantry.design(2_457_600, 9600).inputs)


@pytest.fixture(scope="module")
def gcode(serve) -> Iterator[str]:
    with serve("gcode", "--steps", 80, 80, 400, "--rate", 6000, 6000, 1200,
               "--acceleration", 500, 500, 100, "--tcp", 0, says=r"socket://\S+") as url:
        yield url


@pytest.fixture
def machine(gcode) -> Iterator[GCode]:
    with GCode(gcode, timeout=PATIENCE) as machine:
        machine.stream(["G90 G21 G94", "G53 G0 X0 Y0 Z0"])
        machine.wait(timeout=PATIENCE)
        yield machine


def test_inputs_that_can_be_typed_are_inputs_of_the_machine():
    served = servable()["gcode"]
    assert {*served.how.contacts} < {*served.design(2_457_600, 9600).inputs}


@pytest.mark.parametrize("name", [name for name, board in BOARDS.items()
                                  if "gcode" in board.allotments])
@pytest.mark.usefixtures("unused")
def test_on_a_board_these_are_those_that_have_a_pin(name):
    parser = argparse.ArgumentParser()
    servable()["gcode"].add_options(parser.add_argument_group())
    small = name == "tang-nano-20k"
    options = parser.parse_args([] if small else ["--second-motor", "y"])
    served = servable()["gcode"].chosen(options).on(BOARDS[name])
    assert {*served.contacts} == {"stop", "hold", "start", "probe"} | (
        set() if small else {"door", "abort", "motor_fault", "reset"})
    assert served.further_switches == ({} if small else {"Y2-": "second_limit"})
    assert served.values["probing"] == ("no" if name == "nexys2-500" else None)
    assert {*served.contacts, *served.further_switches.values(), "limits", "rx"} == {
        *served.design(2_457_600, 115_200).inputs}


@pytest.mark.compiler
@pytest.mark.usefixtures("machine")
def test_the_session_of_the_page(gcode):
    page = (ROOT / "docs" / "gcode.md").read_text(encoding="utf-8")
    session = re.findall(r"```\n(\?\n.*?)```", page, re.S)
    assert len(session) == 1
    lines = session[0].encode().splitlines()
    with serial.serial_for_url(gcode, timeout=PATIENCE) as port:
        for typed, answer in zip(lines[::2], lines[1::2], strict=True):
            seen = b""
            while not seen.startswith(answer.partition(b"|FS")[0]):
                assert not seen or seen.startswith(b"<Run")
                port.write(typed if typed == b"?" else typed + b"\r")
                seen = port.readline().strip()


@pytest.mark.parametrize(("machine", "board", "why"), [
    ("mill", "icepi-zero", "always served on a Nexys 2"),
    ("vplotter", "icebreaker", "has no pins")])
def test_where_it_cannot_be_it_says_so(machine, board, why):
    with pytest.raises(ValueError, match=why):
        servable()[machine].on(BOARDS[board])


def test_its_line_is_as_fast_as_that_of_grbl():
    """No slower than the page says: how long a job takes may depend on its line."""
    page = (ROOT / "docs" / "gcode.md").read_text(encoding="utf-8")
    assert servable()["gcode"].how.baud == 115_200
    assert re.findall(r"^(\d+) baud, 8N1", page, re.M) == ["115200"]


def test_without_the_fast_engine_it_says_what_to_install():
    with pytest.raises(UserError, match=r"C\+\+ compiler: pip install"):
        build(servable()["gcode"], "amaranth")


@pytest.mark.compiler
@pytest.mark.long
def test_a_program_of_its_own_starts_and_is_held_by_what_is_typed(libraries, tmp_path):
    program = tmp_path / "part.ngc"
    program.write_text("G21 G91\nG1 X200 F600\nM30\n")
    with running("tools.serve", "gcode", "--program", program, "--board", "ulx3s-25f",
                 "--tcp", 0) as command:
        with serial.serial_for_url(command.first(r"socket://\S+"), timeout=1) as port:
            def state() -> bytes:
                port.write(b"?")
                report = port.readline()
                return report.partition(b"|")[0] if report.startswith(b"<") else b""

            def wait_for(name: bytes) -> None:
                end = time.monotonic() + PATIENCE
                while state() != name:
                    assert time.monotonic() < end

            wait_for(b"<Idle")
            for typed, expected in (("start on", b"<Run"), ("door on", b"<Door:1"),
                                    ("start off", b"<Door:1"), ("door off", b"<Door:0"),
                                    ("start on", b"<Run"), ("hold on", b"<Hold:0"),
                                    ("abort on", b"<Idle")):
                command.type(typed)
                wait_for(expected)


@pytest.mark.compiler
@pytest.mark.long
class TestSession:
    def test_a_person_at_a_terminal(self, gcode):
        with serial.serial_for_url(gcode, timeout=PATIENCE) as port:
            port.write(b"$X\r\n")
            while port.readline() != b"ok\r\n":  # it may still be greeting
                pass
            port.write(b"g91g1x.1f600\rX1 X2\n?")
            lines = [port.readline() for _ in range(3)]
            assert [line for line in lines if not line.startswith(b"<")] == [
                b"ok\r\n", b"error:25\r\n"]
            (report,) = (line for line in lines if line.startswith(b"<"))
            assert report.startswith((b"<Run|MPos:", b"<Idle|MPos:"))

    def test_a_file(self, machine, tmp_path):
        path, seen = tmp_path / "part.ngc", []
        path.write_text("(a square)\n\nG1 X2 F3000\nY2\nG2 X0 Y0 I-1 J-1\nG0 X1.5 Z-0.5\n")
        machine.stream(path, lambda done, total: seen.append((done, total)))
        machine.wait(timeout=PATIENCE)
        assert seen[-1] == (4, 4) and seen == sorted(seen)
        assert machine.position == machine.machine_position == (1.5, 0, -0.5)
        assert machine.state == "Idle"
        machine.command("G92 X10")
        assert machine.position == (10, 0, -0.5) and machine.machine_position == (1.5, 0, -0.5)
        machine.command("G92.1")

    def test_a_hold_and_its_end(self, machine):
        machine.stream(["G1 X8 F1200"])
        while machine.position.x < 1:
            pass
        machine.hold()
        while machine.state != "Hold":
            time.sleep(0.01)
        with pytest.raises(TimeoutError):
            machine.wait(timeout=1)
        held = machine.position
        assert 1 <= held.x < 8 and machine.position == held
        machine.resume()
        machine.wait(timeout=PATIENCE)
        assert machine.position == (8, 0, 0)

    def test_a_line_that_is_refused(self, machine):
        with pytest.raises(BlockRefused, match="arc's radii differ") as refused:
            machine.stream(["G1 X1 F3000", "G2 X9 I1", "G1 X2"], line_by_line=True)
        assert (refused.value.line, refused.value.code) == (2, 33)
        machine.wait(timeout=PATIENCE)
        assert machine.position == (1, 0, 0)

    def test_a_stop(self, machine):
        stopper = threading.Timer(1, machine.stop)
        stopper.start()
        with pytest.raises(JobStopped):
            machine.stream([f"G1 X{n} F1200" for n in range(1, 999)])
            machine.wait()
        stopper.join()
        place = machine.machine_position
        assert 0 < place.x < 999 and machine.state == "Idle"
        machine.stream(["G0 X0"])
        machine.wait(timeout=PATIENCE)
        assert machine.position == (0, 0, 0)

    def test_the_example(self, gcode, example, tmp_path):
        path = tmp_path / "part.ngc"
        path.write_text("G53 G0 X0 Y0 Z0\nG1 X1 F3000\n")
        assert example("stream_gcode.py", gcode, path) == ["at X1.000 Y0.000 Z0.000"]
