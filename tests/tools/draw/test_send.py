"""Drawings that are sent, to a machine that speaks the protocol, with holds and changes of pens."""

import io
import queue
import signal
import threading
import time
from typing import Any

import pytest

from fresa_host import GCode
from tests.host.fake_gcode import FakeGCode
from tests.tools.draw.drawings import write
from tools.draw import __main__ as command
from tools.draw import send

LAYERS = """<g inkscape:groupmode="layer" inkscape:label="A"><rect width="9" height="9"/></g>
    <g inkscape:groupmode="layer" inkscape:label="B"><circle r="9"/></g>"""


class Terminal(io.StringIO):
    """A terminal at which lines are typed, and at last nothing more."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: queue.Queue[str] = queue.Queue()

    def isatty(self) -> bool:
        return True

    def __iter__(self):
        return iter(self.lines.get, "")


@pytest.fixture
def typed(monkeypatch):
    """Give what is typed: lines, to be put."""
    monkeypatch.setattr("sys.stdin", terminal := Terminal())
    yield terminal.lines
    terminal.lines.put("")


@pytest.fixture
def fake(monkeypatch) -> FakeGCode:
    monkeypatch.setattr(send, "POLL_S", 0.005)
    fake: Any = FakeGCode()
    monkeypatch.setattr("fresa_host.VPlotter", lambda port, baud: GCode(fake, timeout=60))
    return fake


def run(path, *arguments: str) -> int:
    return command.main([str(path), "--to", "fake", "--sort", "own", *arguments])


def wait_for(happened) -> None:
    end = time.monotonic() + 120
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.002)


def in_time(*events) -> threading.Thread:
    """Do things in another thread, each once its condition holds."""
    def work():
        for condition, action in events:
            wait_for(condition)
            action()

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


def test_one_pen(fake, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", None)
    path = write(tmp_path, LAYERS)
    assert run(path, "--pens", "one", "--out", str(tmp_path / "a.gcode")) == 0
    assert "drawn in " in capsys.readouterr().out
    lines = [line for line in (tmp_path / "a.gcode").read_text().splitlines() if line[0] != "("]
    assert fake.lines == ["$$", *lines] and fake.closed and fake.lines[-1] == "M2"
    assert fake.most > 100  # sent ahead


def test_pens_are_changed_between(fake, tmp_path, typed, monkeypatch):
    path = write(tmp_path, LAYERS)
    sent, notes = [], []
    monkeypatch.setattr(send, "warn", notes.append)
    thread = in_time((lambda: notes, lambda: (
        time.sleep(0.05), sent.extend(fake.lines), typed.put("\n"))))
    assert run(path) == 0
    thread.join()
    assert sent[-1] == "G0 X884 Y884" and sent.count("M3 S1000") == 1  # waits for the Return
    assert fake.lines[:len(sent)] == sent and fake.lines.count("M3 S1000") == 2
    assert "M0" not in fake.lines
    assert notes == ["change to pen 2: B; then Return goes on, Ctrl-C ends"]


def test_pens_need_a_keyboard(fake, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", None)
    assert run(write(tmp_path, LAYERS)) == 2
    assert "2 pens are to be changed, and there is no keyboard" in capsys.readouterr().err
    assert not fake.lines


def test_control_c_holds_and_return_goes_on(fake, tmp_path, typed, capsys):
    path = write(tmp_path, LAYERS)
    obey = fake.obey

    def slow(line):
        time.sleep(0.002)
        obey(line)

    fake.obey = slow
    thread = in_time((lambda: len(fake.lines) > 9, lambda: signal.raise_signal(signal.SIGINT)),
                     (lambda: b"!" in fake.real_time, lambda: typed.put("\n")))
    assert run(path, "--pens", "one", "--tolerance", "0.01") == 0
    thread.join()
    assert fake.real_time == [b"!", b"~"] and fake.lines[-1] == "M2"
    err = capsys.readouterr().err
    assert "held; Return goes on, Ctrl-C ends" in err and "going on" in err


def test_control_c_again_ends_with_the_pen_raised(fake, tmp_path, typed, capsys):
    path = write(tmp_path, LAYERS)
    obey = fake.obey

    def slow(line):
        time.sleep(0.002)
        obey(line)

    fake.obey = slow
    thread = in_time((lambda: len(fake.lines) > 9, lambda: typed.put("q\n")))
    assert run(path, "--pens", "one", "--tolerance", "0.01") == 130
    thread.join()
    assert "ended: the machine stands, with the pen raised" in capsys.readouterr().out
    assert fake.real_time[-1] == b"\x18" and "M2" not in fake.lines and fake.closed


def test_a_line_that_is_refused_ends_it(fake, tmp_path, typed, capsys):
    obey, fake.obey = fake.obey, lambda line: obey("G99" if line.startswith("G1") else line)
    assert run(write(tmp_path, LAYERS), "--pens", "one") == 1
    assert "the machine refused: line 6" in capsys.readouterr().out
    assert fake.real_time[-1] == b"\x18"  # stopped


def test_a_machine_that_is_locked(fake, tmp_path, typed, capsys):
    fake.state = "Alarm"
    path = write(tmp_path, LAYERS)
    assert run(path, "--pens", "one") == 2
    assert "home it, by --home" in capsys.readouterr().err and fake.lines == ["$$"]
    fake.closed = False
    del fake.lines[:]
    assert run(path, "--pens", "one", "--home") == 0
    assert fake.lines[:3] == ["$$", "$H", "G21 G90 G94 G54"] and fake.lines[-1] == "M2"


@pytest.mark.parametrize(("settings", "arguments"), [
    ({"130": "1778.000", "131": "1568.000"}, []), ({"130": "1768.000", "131": "1500.000"}, []),
    ({"130": "1768.000", "131": "1800.000"}, []),
    ({"130": "1768.000", "131": "1568.000"}, ["--home"]),
])
def test_a_machine_of_another_wall_draws_nothing(fake, tmp_path, typed, capsys, settings,
                                                 arguments):
    """The fake one homes to 0,0, which is no place of rest."""
    fake.settings = settings
    assert run(write(tmp_path, LAYERS), "--pens", "one", *arguments) == 2
    err = capsys.readouterr().err
    assert "the machine hangs on another wall" in err and err.count("error") == 1
    assert not [line for line in fake.lines if line[0] != "$"]


def test_a_machine_of_this_wall_draws(fake, tmp_path, typed):
    fake.settings = {"130": "1768.000", "131": "1568.000"}
    assert run(write(tmp_path, LAYERS), "--pens", "one", "--rest", "1768,200", "--home") == 0
    assert fake.lines[-1] == "M2"
