"""Whole sessions with the gateware of `single`."""

import time
from collections.abc import Iterator

import pytest

from fresa_host import Single
from tests.tools.process import PATIENCE

serial = pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")


@pytest.fixture(scope="module")
def single(serve) -> Iterator[str]:
    with serve("single") as path:
        yield path


@pytest.mark.compiler
class TestSession:
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
            end = time.monotonic() + PATIENCE
            while ask(b":x?\r", 2) != [b"x:40\r\n", b"ok\r\n"]:  # it may still be on its way
                assert time.monotonic() < end

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

    @pytest.mark.long
    def test_with_a_ramp(self, serve):
        with (serve("single", "--ramp", 100, "--top-speed", 100) as path,
              Single(path, timeout=PATIENCE) as motor):
            motor.speed = 59_999
            motor.move_to(9000)  # in two minutes; without the ramp it takes a fifth of a second
            time.sleep(0.5)
            assert 0 < motor.position < 9000

    def test_the_example(self, single, example):
        assert example("turn_single.py", single)[1:] == [
            "at 96, with 30 turns a minute", "at 0, with 120 turns a minute"]
