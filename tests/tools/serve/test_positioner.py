"""Whole sessions with the gateware of `positioner`."""

import argparse
import re
import time
from collections.abc import Iterator

import pytest

from fresa_host import Place, Positioner, Refused
from tests.tools.process import PATIENCE
from tools.serve import servable

serial = pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")


@pytest.fixture(scope="module")
def positioner(serve) -> Iterator[str]:
    with serve("positioner", "--tcp", 0, says=r"socket://\S+") as url:
        yield url


@pytest.mark.compiler
class TestSession:
    def test_a_person_at_a_terminal(self, positioner):
        with serial.serial_for_url(positioner, timeout=PATIENCE) as port:
            port.write(b"MOV MOT1 C\nCONNECT\n")
            assert port.readline() == b"! DISCONNECTED\n"
            assert port.read_until(b":") == b"# POS 0 0 0 :"
            port.write(b"GOTO 3\nP 99 1 2 3\nVEL MOT1 0\nMOVE\nMOV MOT4 C\n")
            port.write(b"ACK 1\nDISCONNECT\nSTATE\nACK 0\n")
            text = b"".join(port.readline() for _ in range(8))
            answers = re.sub(rb"# POS 0 0 0 :", b"", text).splitlines()
            assert answers[:-1] == [b"! EMPTY", b"! RANGE", b"! RANGE", b"! COMMAND",
                                    b"! ARGUMENT", b"ok", b"ok"]
            assert answers[-1].startswith(b"STATE 0 0 0 0 200 200 200 0 0 0 0 0 0 ")

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
        # A line and its answer are less than to compile it would be.
        with (serve("positioner", "--engine", "amaranth", "--top-speed", 100, "--backlash", 9, 0, 0
                    ) as path,
              serial.Serial(path, timeout=PATIENCE) as port):
            port.write(b"VEL MOT1 101\n")
            assert port.readline() == b"! RANGE\n"

    def test_the_example(self, positioner, example):
        assert example("scan_positioner.py", positioner) == [
            f"measure at x {x}, y {y} um" for x, y in [
                ("0.00", "0.00"), ("4.00", "0.00"), ("8.00", "0.00"),
                ("8.00", "4.00"), ("4.00", "4.00"), ("0.00", "4.00")]]


def test_switches_are_at_the_ends_that_are_asked_for():
    served, parser = servable()["positioner"], argparse.ArgumentParser()
    served.add_options(parser.add_argument_group())
    ends = ["Y-", "X+", "Z-"]
    assert served.chosen(parser.parse_args(["--guards", *ends])).switches == tuple(ends)
