"""Whole sessions with the gateware of `mill`, as its users have them; and what ends in one line."""

import socket
import subprocess
import sys

import pytest

from fresa_host import Kind, Mill, Order
from tests.tools.process import ROOT
from tools.serve.__main__ import main

serial = pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")


@pytest.mark.compiler
@pytest.mark.long
class TestMill:
    def test_a_program_with_fresa_host(self, serve):
        with serve("mill", "--speed", "max") as path, Mill(path) as mill:
            assert not mill.state().manual
            reported = []
            for orders in ([Order(Kind.GO, 40, 8), Order(Kind.GO, 0, 0)], [Order(Kind.GO, 0, 9)]):
                mill.carry_out(orders, progress=lambda done, _: reported.append(done))
                assert reported[-1] == len(orders) and mill.state().session == 0
            assert reported[0] == 0


def test_examples_say_what_they_need(tmp_path):
    file = tmp_path / "lines.txt"
    file.write_text("1 1 2 2\n")
    for path in sorted((ROOT / "examples").glob("*_*.py")):
        program = [file] if 'add_argument("file"' in path.read_text(encoding="utf-8") else []
        done = subprocess.run([sys.executable, path, "/no/such/port", *program],
                              capture_output=True, text=True, check=False)
        assert done.returncode == 1 and not done.stdout
        assert done.stderr.startswith("error: /no/such/port cannot be opened")
        assert done.stderr.count("\n") == 1


def test_a_port_that_is_taken_is_told_before_anything_is_built(monkeypatch, capsys):
    monkeypatch.setattr("tools.serve.__main__.build", lambda *_: pytest.fail("it is built"))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["single", "--tcp", str(port)]) == 2
    assert capsys.readouterr().err.startswith(f"error: port {port} is not available")


@pytest.mark.parametrize(("arguments", "message"), [
    (["sinlge"], "there is no machine 'sinlge'; did you mean single?"),
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
