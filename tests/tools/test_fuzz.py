# amaranth: UnusedElaboratable=no

"""The command that fuzzes: what it says, what it writes, and its exit status."""

import json
from dataclasses import replace

import pytest
from amaranth import Mux

from fresa.protocol import frames
from tb.machines import machines
from tb.mistake import Mistake
from tb.registry import fuzz_targets
from tools import fuzz
from tools.fuzz import main

OBEYS_REFUSED = Mistake("commands.target", lambda right, at: Mux(
    at("commands.answer") == frames.Answer.RANGE.value, at("commands.value"), right))


@pytest.mark.compiler
def test_all_in_order(libraries, tmp_path, capsys):
    assert main(["single", "--bytes", "500", "--rates", "1", "--json", str(tmp_path / "f")]) == 0
    output = capsys.readouterr().out
    assert "500" in output or "bytes" in output
    machine, = json.loads((tmp_path / "f").read_text())["machines"]
    assert machine["name"] == "single" and machine["good"] and machine["bytes"] >= 500
    assert machine["lines"] == machine["answers"] > 10
    assert machine["times"]["beyond_rounding"] == 0 and machine["times"]["steps"] > 1000


@pytest.mark.compiler
@pytest.mark.long
def test_something_found(libraries, tmp_path, capsys, monkeypatch):
    save, target = tmp_path / "found", fuzz_targets()["single"]
    wrong = replace(target, design=lambda: OBEYS_REFUSED.planted(target.design()))
    monkeypatch.setattr(fuzz, "fuzz_targets", lambda: {"single": wrong})
    assert main(["single", "--bytes", "3000", "--save", str(save), "--shrink-seconds", "5",
                 "--json", str(tmp_path / "f")]) == 1
    output = capsys.readouterr().out
    assert "FOUND" in output and "shortest" in output
    assert 0 < len((tmp_path / "found-single.bin").read_bytes()) < 60
    assert b"$enddefinitions" in (tmp_path / "found-single.vcd").read_bytes()
    machine, = json.loads((tmp_path / "f").read_text())["machines"]
    assert not machine["good"] and machine["shortest"]["pieces"]


@pytest.mark.parametrize(("arguments", "message"), [
    (["sinlge"], "did you mean single?"),
    (["--bytes", "-1"], "must be a whole number from 0"),
    (["--save", "/nowhere/fuzz"], "its folder does not exist"),
    (["--json", "/nowhere/f"], "its folder does not exist"),
])
def test_says_in_a_line_what_is_wrong(arguments, message, capsys):
    assert main(arguments) == 2
    output = capsys.readouterr().err
    assert message in output and output.count("\n") == 1


def test_needs_a_compiler(monkeypatch, capsys):
    monkeypatch.setattr(fuzz.CXXRTLEngine, "missing", classmethod(lambda _: "install g++"))
    assert main(["single"]) == 2
    assert "install g++" in capsys.readouterr().err


def test_a_machine_without_a_line(monkeypatch, capsys):
    monkeypatch.setitem(machines(), "mill", replace(machines()["mill"], fuzz=None))
    assert main(["mill"]) == 2
    assert capsys.readouterr().err == "error: mill has no serial line\n"
