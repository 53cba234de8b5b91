"""`GCode`: programs, positions, and what goes wrong, with a machine that obeys the protocol."""

import runpy
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from fresa_host import (
    Alarmed,
    BlockRefused,
    GCode,
    JobStopped,
    MachineError,
    TimedOut,
    WasReset,
    gcode_session,
)
from tests.host.fake_gcode import FakeGCode

EXAMPLE = Path(__file__).parents[2] / "examples" / "stream_gcode.py"


@pytest.fixture
def fake(monkeypatch) -> FakeGCode:
    monkeypatch.setattr(gcode_session, "POLL_S", 0.01)
    return FakeGCode()


def opened(fake: FakeGCode, timeout: float = 0.3) -> GCode:
    port: Any = fake
    return GCode(port, timeout=timeout)


PROGRAM = ["%", "G21 G90 (millimetres)", "", "G92 X1 Y2 Z3",
           *(f"G1 X{n / 10:.1f} Y{-n}.5 F600 ; line" for n in range(40)), "M2"]


@pytest.mark.parametrize("line_by_line", [False, True])
def test_a_program_is_streamed(fake, line_by_line):
    with opened(fake) as machine:
        seen = []
        machine.stream(PROGRAM, lambda done, total: seen.append((done, total)),
                       line_by_line=line_by_line)
        machine.wait(5)
        assert seen[0] == (0, 43) and seen[-1] == (43, 43) and sorted(set(seen)) == seen
        assert machine.position == pytest.approx((3.9, -39.5, 3))
        assert machine.machine_position == pytest.approx((2.9, -41.5, 0))
        assert machine.state == "Idle"
    assert len(fake.lines) == 43 and fake.lines[0] == "G21 G90"
    assert fake.most <= (20 if line_by_line else 127) and fake.closed
    assert line_by_line or fake.most > 100


def test_a_file_is_streamed(fake, tmp_path):
    path = tmp_path / "part.ngc"
    path.write_bytes(b"G0 X1 (\xb5m)\r\nG0 Y2\r\n")
    with opened(fake) as machine:
        machine.stream(path)
        machine.wait()
        assert machine.machine_position == (1, 2, 0)


def test_nothing_is_sent_of_a_program_that_cannot_be(fake):
    with opened(fake) as machine, pytest.raises(ValueError, match="line 2: '!' may not be"):
        machine.stream(["G0 X1", "G0!"])
    assert not fake.lines


def test_what_is_refused_names_its_line(fake):
    with opened(fake) as machine:
        with pytest.raises(BlockRefused, match="line 3: the arc's radii differ|line 3: the target"):
            machine.stream(["G0 X1", "", "G2 X10 I4 F60", "G0 X5"])
        with pytest.raises(BlockRefused, match=r"there is no such command, in 'G99' \(error:20\)"):
            machine.command("G99")
        assert machine.command("$I") == ["[VER:1.1h.20190830:]", "[OPT:VM,15,128]"]


def test_a_jog_and_its_end(fake):
    with opened(fake) as machine:
        machine.jog(600, x=-1.5, z=2)
        machine.wait()
        assert machine.machine_position == (-1.5, 0, 2)
        machine.end_jog()
        with pytest.raises(ValueError, match="nan"):
            machine.jog(float("nan"), x=1)
        wrong: Any
        for wrong in ("1", None, 10**400):
            with pytest.raises(ValueError, match="not a way, or no feed: .*'Y'"):
                machine.jog(100, y=wrong)
    assert fake.lines[-1] == "$J=G21G91X-1.500Y0.000Z2.000F600.000"
    assert fake.real_time[-1] == b"\x85"


def test_a_probing_says_where_it_touched_and_leaves_the_modes(fake):
    with opened(fake) as machine:
        assert machine.probe(60, z=-5) is None
        fake.touches = -1.25
        assert machine.probe(60, x=1, z=-5, away=True) == (0, 0, -1.25)
        with pytest.raises(ValueError, match="inf"):
            machine.probe(60, z=float("inf"))
    assert fake.lines[-3:] == ["$G", "G21G91G94G38.5X1.000Y0.000Z-5.000F60.000",
                               "G0G54G17G20G90G94"]


def test_an_alarm_and_what_ends_it(fake):
    fake.alarms["G0 X9000"] = 2
    with opened(fake) as machine:
        machine.command("G0 X5")
        with pytest.raises(Alarmed, match="beyond the travel"):
            machine.stream(["G0 X9000", "G0 X1"])
        assert machine.state == "Alarm"
        with pytest.raises(BlockRefused, match="locked by an alarm"):
            machine.command("G0 X1")
        with pytest.raises(Alarmed, match="home, or unlock it"):
            machine.wait()
        machine.unlock()
        assert machine.state == "Idle" and machine.machine_position == (5, 0, 0)
        assert machine.home() == (0, 0, 0)


def test_a_reset_by_something_else(fake):
    with opened(fake) as machine:
        fake.reset()
        with pytest.raises(WasReset):
            machine.command("G0 X1")
        machine.command("G0 X1")
    assert fake.lines == ["G0 X1"]


def test_silence_and_lost_answers(fake):
    with opened(fake) as machine:
        fake.lose = 1
        with pytest.raises(TimedOut, match="the answer to 'G0 X1' was lost"):
            machine.stream(["G0 X1"])
        machine.stop()
        machine.stream(["G0 X2"])
        fake.deaf = True
        with pytest.raises(TimedOut, match="fake is silent"):
            machine.stream(["G0 X1"])
    with pytest.raises(TimedOut, match="no machine answers at fake"):
        opened(fake)


def test_hold_resume_and_stop_from_another_thread(fake):
    errors = []

    def run() -> None:
        try:
            machine.stream([f"G1 X{n} F600" for n in range(2000)])
        except MachineError as error:
            errors.append(error)

    with opened(fake, timeout=2.0) as machine:
        thread = threading.Thread(target=run)
        thread.start()
        machine.hold()
        end = time.monotonic() + 5
        while fake.state != "Hold:0" and time.monotonic() < end:
            machine.hold()
            time.sleep(0.001)
        held = len(fake.lines)
        time.sleep(0.05)
        assert len(fake.lines) <= held + 1
        machine.resume()
        while len(fake.lines) < held + 5 and time.monotonic() < end:
            time.sleep(0.001)
        machine.stop()
        thread.join(5)
        assert not thread.is_alive()
        assert [type(error) for error in errors] == [JobStopped]
        machine.stream(["G0 X1"])
        assert fake.lines[-1] == "G0 X1"
    assert fake.real_time[-2:] == [b"!", b"\x18"]


def test_an_exception_stops_the_machine(fake):
    def interrupt(done: int, total: int) -> None:
        if done == 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), opened(fake) as machine:
        machine.stream(PROGRAM, interrupt)
    assert fake.real_time[-1:] == [b"\x18"] and fake.closed and len(fake.lines) < 43


def test_the_example(fake, monkeypatch, tmp_path, capsys):
    path = tmp_path / "part.ngc"
    path.write_text("G0 X1\nG0 Y2\n")
    monkeypatch.setattr("fresa_host.GCode", lambda port, baud: opened(fake))
    monkeypatch.setattr("sys.argv", ["stream_gcode.py", "fake", str(path), "--home"])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    out, err = capsys.readouterr()
    assert out == "at X1.000 Y2.000 Z0.000\n" and err.endswith("2 of 2 lines\n")
    assert fake.lines == ["$H", "G0 X1", "G0 Y2"]
    path.write_text("G0 X1\nG99\n")
    with pytest.raises(SystemExit, match="error: .*line 2: there is no such command, in 'G99'"):
        runpy.run_path(str(EXAMPLE), run_name="__main__")
