"""Whole sessions with the machines' own gateware, as their users have them: through pyserial."""

import argparse
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from fresa_host import Kind, Mill, Order, Place, Positioner, Refused, Single
from tb.engines import ENGINES
from tests.tools.process import PATIENCE, ROOT, command
from tools.serve import servable
from tools.serve.__main__ import main

serial = pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")


@pytest.fixture(scope="module")
def serve(libraries) -> Callable:
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)  # the slow engine takes a minute for what a machine does in a second

    def serve(machine: str, *options: object, says: str = r"/dev/\S+"):
        return command("tools.serve", machine, *options, says=says)

    return serve


@pytest.fixture(scope="module")
def single(serve) -> Iterator[str]:
    with serve("single") as path:
        yield path


@pytest.fixture(scope="module")
def positioner(serve) -> Iterator[str]:
    with serve("positioner", "--tcp", 0, says=r"socket://\S+") as url:
        yield url


@pytest.mark.compiler
class TestSingle:
    def test_a_person_at_a_terminal(self, single):
        with serial.Serial(single, 9600, timeout=PATIENCE) as port:
            def ask(frame: bytes, lines: int) -> list[bytes]:
                port.write(frame)
                return [port.readline() for _ in range(lines)]

            assert ask(b":v?\r", 0) == []
            while port.readline() != b"v:100\r\n":  # it may still be greeting
                pass
            assert port.readline() == b"ok\r\n"
            assert ask(b":V6000\r", 1) == [b"ok\r\n"]
            assert ask(b"noise :x5:x40\r", 1) == [b"ok\r\n"]
            assert ask(b":x10000\r", 1) == [b"err range\r\n"]
            assert ask(b":x4a\r", 1) == [b"err number\r\n"]
            assert ask(b":q\r", 1) == [b"err command\r\n"]
            assert ask(b":" + b"x" * 200 + b"\r", 1) == [b"err length\r\n"]
            assert ask(b":v0\r", 1) == [b"err range\r\n"]
            *help_text, last = ask(b":d\r", 9)
            assert last == b"ok\r\n" and any(b":xN" in line for line in help_text)
            time.sleep(0.1)
            assert ask(b":x?\r", 2) == [b"x:40\r\n", b"ok\r\n"]

    def test_a_program_with_fresa_host(self, single):
        with Single(single, timeout=PATIENCE) as motor:
            motor.speed = 30_000
            assert motor.speed == 30_000
            start = motor.position
            motor.power(False)
            motor.move_to(500)
            assert motor.position == start
            motor.power(True)
            assert motor.wait(timeout=PATIENCE) == 500
            motor.move_to(0)
            motor.wait(timeout=PATIENCE)
            assert "go to N" in motor.help()


    def test_with_a_ramp(self, serve):
        with (serve("single", "--ramp", 100, "--top-speed", 100) as path,
              Single(path, timeout=PATIENCE) as motor):
            motor.speed = 59_999
            motor.move_to(9000)  # in two minutes; without the ramp it takes a fifth of a second
            time.sleep(0.5)
            assert 0 < motor.position < 9000

    def test_the_example(self, single):
        assert example("turn_single.py", single)[1:] == [
            "at 96, with 30 turns a minute", "at 0, with 120 turns a minute"]


@pytest.mark.compiler
class TestPositioner:
    def test_a_person_at_a_terminal(self, positioner):
        with serial.serial_for_url(positioner, timeout=PATIENCE) as port:
            port.write(b"MOV MOT1 C\nCONNECT\n")
            assert port.readline() == b"! DISCONNECTED\n"
            assert re.fullmatch(rb"# POS 0 0 0 :\n", port.readline())
            port.write(b"GOTO 3\nP 99 1 2 3\nVEL MOT1 0\nMOVE\nMOV MOT4 C\n")
            answers = [line for line in (port.readline() for _ in range(15)) if line[:1] == b"!"]
            assert answers == [b"! EMPTY\n", b"! RANGE\n", b"! RANGE\n", b"! COMMAND\n",
                               b"! ARGUMENT\n"]
            port.write(b"DISCONNECT\n")

    def test_a_program_with_fresa_host(self, positioner):
        with Positioner(positioner, timeout=PATIENCE) as three:
            assert three.connect() == (0, 0, 0)
            for axis in "xyz":
                assert three.velocity(axis, 26.4) == pytest.approx(26.4, abs=0.03)
            three.move_to(5, -3, 0)
            assert three.wait(timeout=PATIENCE).steps == Place(5, -3, 0).steps == (284, -170, 0)
            three.jog("z", -1)
            while three.position.z > -1:
                time.sleep(0.01)
            three.stop("z")
            three.origin()
            assert three.position == (0, 0, 0)
            three.call_place(1, 2, 3)
            assert three.steps == (57, 114, 170)
            three.disconnect()
            three.jog("x", 1)
            with pytest.raises(Refused, match="DISCONNECTED"):
                three.velocity("x", 10)


    def test_built_in_another_way(self, serve):
        with (serve("positioner", "--top-speed", 100, "--backlash", 9, 0, 0) as path,
              serial.Serial(path, timeout=PATIENCE) as port):
            port.write(b"VEL MOT1 101\n")
            assert port.readline() == b"! RANGE\n"

    def test_the_example(self, positioner):
        assert example("scan_positioner.py", positioner) == [
            f"measure at x {x}, y {y} um" for x, y in [
                ("0.00", "0.00"), ("4.00", "0.00"), ("8.00", "0.00"),
                ("8.00", "4.00"), ("4.00", "4.00"), ("0.00", "4.00")]]


@pytest.mark.compiler
class TestMill:
    def test_a_program_with_fresa_host(self, serve):
        with serve("mill", "--speed", "max") as path, Mill(path) as mill:
            assert not mill.state().manual
            told = []
            for orders in ([Order(Kind.GO, 40, 8), Order(Kind.GO, 0, 0)], [Order(Kind.GO, 0, 9)]):
                mill.carry_out(orders, progress=lambda done, _: told.append(done))
                assert told[-1] == len(orders) and mill.state().session == 0
            assert told[0] == 0


def test_examples_say_what_they_need():
    for name in ("turn_single.py", "scan_positioner.py", "mill_rosette.py"):
        done = subprocess.run([sys.executable, ROOT / "examples" / name, "/no/such/port"],
                              capture_output=True, text=True, check=False)
        assert done.returncode == 1 and not done.stdout
        assert done.stderr.startswith("error: /no/such/port cannot be opened")
        assert done.stderr.count("\n") == 1


def example(name: str, port: str) -> list[str]:
    return subprocess.run([sys.executable, ROOT / "examples" / name, port], capture_output=True,
                          text=True, check=True, timeout=PATIENCE).stdout.splitlines()


def test_a_port_that_is_taken_is_told_before_anything_is_built(monkeypatch, capsys):
    monkeypatch.setattr("tools.serve.__main__.build", lambda *_: pytest.fail("it is built"))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["single", "--tcp", str(port)]) == 2
    assert capsys.readouterr().err.startswith(f"error: port {port} is not available")


def test_switches_are_at_the_ends_that_are_asked_for():
    served, parser = servable()["positioner"], argparse.ArgumentParser()
    served.add_options(parser.add_argument_group())
    ends = ["Y-", "X+", "Z-"]
    assert served.chosen(parser.parse_args(["--guards", *ends])).switches == tuple(ends)


@pytest.mark.parametrize(("arguments", "message"), [
    (["positoner"], "there is no machine 'positoner'; did you mean positioner?"),
    (["single", "--speed", "0"], "argument --speed: must be 0.001 to 1000, or max, not '0'"),
    (["single", "--speed", "nan"], "must be 0.001 to 1000, or max, not 'nan'"),
    (["single", "--tcp", "70000"], "must be a whole number from 0 to 65535, not '70000'"),
    ([], "the following arguments are required: MACHINE"),
    (["single", "--top-speed", "9"], "leave out --top-speed: without --ramp every speed is made"),
    (["single", "--backlash", "1"], "unrecognized arguments: --backlash 1"),
    (["--ramp", "10", "single", "--engine", "amaranth"], "more than 4096 steps"),
])
def test_mistakes_are_one_line(arguments, message, capsys):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and message in err
