# amaranth: UnusedElaboratable=no

"""The command that strikes the machine, and what is built to withstand it."""

import json
import re
from dataclasses import replace

import pytest
from amaranth import Cat, Mux

from tb.faults.target import FaultTarget
from tb.machines import machines
from tb.machines.mill import faults as mill
from tb.mistake import Mistake
from tools import build
from tools.faults import __main__ as faults
from tools.faults import inject
from tools.synthesis import Resources


def run(*arguments: object) -> int:
    return faults.main([str(argument) for argument in arguments])


def run_json(path, *arguments: object) -> tuple[int, list[dict]]:
    """Run the command; give its status, and what it says of each machine."""
    status = run(*arguments, "--json", path)
    machines = json.loads(path.read_text())["machines"]
    for machine in machines:
        for name in ("seconds", "flips_per_second"):
            machine.pop(name, None)
    return status, machines


def declare(monkeypatch, *builds: FaultTarget) -> None:
    """Have other builds of the mill."""
    makers = {build.guard: lambda build=build: build for build in builds}
    monkeypatch.setitem(machines(), "mill", replace(machines()["mill"], faults=lambda: makers))


@pytest.mark.compiler
class TestFlips:
    def test_silent_without_guard_and_never_with_it(self, tmp_path, capsys):
        status, (plain, guarded) = run_json(tmp_path / "it.json", "flips", "--flips", 60_000)
        assert status == 0
        assert (plain["guard"], guarded["guard"]) == (False, True)
        for machine in (plain, guarded):
            assert machine["flips"] == 60_000
            assert machine["flips"] == sum(
                machine[verdict] for verdict in ("harmless", "visible", "stuck", "silent"))
            assert machine["flip_flops"] == sum(r["bits"] for r in machine["registers"].values())
        assert 0.2 < plain["silent_rate"] < 0.4
        assert len(plain["silent_ones"]) == inject.SHOWN
        assert guarded["silent"] == 0 and guarded["silent_ones"] == []
        printed = capsys.readouterr().out
        assert re.search(r"^0 of 60000 silent \(0.0000%\); ", printed, re.M)
        assert f"{plain['silent']} of 60000 silent" in printed
        assert "  silent: controller." in printed

    def test_same_seed_same_result_on_any_number_of_cores(self, tmp_path):
        arguments = "flips", "--flips", 10_000, "--no-guard", "--seed", 5
        one, three = (run_json(tmp_path / "it.json", *arguments, "--jobs", jobs) for jobs in (1, 3))
        assert one == three
        other = run_json(tmp_path / "it.json", *arguments[:-1], 6)
        assert one[1][0]["silent"] != other[1][0]["silent"]

    def test_guard_with_a_gap_is_found(self, tmp_path, monkeypatch, capsys):
        """A guard that compares no positions lets some through; the status says so."""
        guarded = mill.target(guard=True)
        declare(monkeypatch, replace(guarded, design=GAP.planted(guarded.design)))
        status, (machine,) = run_json(tmp_path / "it.json", "flips", "--flips", 4000, "--guard")
        assert status == 1
        assert machine["silent"] > 10
        assert all(".main.automatic." in upset["register"] for upset in machine["silent_ones"])


def _gap(right, at):
    """Let positions differ, as long as no motor steps."""
    count = Cat(at(f"main.automatic.at_{axis}") != at(f"shadow.automatic.at_{axis}")
                for axis in "xyz").any()
    steps = Cat(at(f"apart_{axis}") != at(f"apart_{axis}_before") for axis in "xyz").any()
    return Mux(count & ~steps, at("controller.fault"), right)


GAP = Mistake("controller.fault", _gap)


@pytest.mark.compiler
class TestResets:
    def test_both_machines(self, tmp_path, capsys):
        status, (plain, guarded) = run_json(tmp_path / "it.json", "resets", "--resets", 1100)
        assert status == 0
        assert plain == {**guarded, "guard": False}
        assert plain["resets"] == 1100 and plain["wrong"] == []
        assert plain["steps"] > 5000 and plain["clocks"] > 1100 * 50
        assert capsys.readouterr().out.count("every coil word legal, none moved") == 2

    def test_mistake_ends_in_status_1(self, monkeypatch, capsys):
        declare(monkeypatch, replace(mill.target(guard=False), kept=("black", "orange", "rest")))
        assert run("resets", "--resets", 1500, "--no-guard") == 1
        assert "started is not as from power-up after a reset" in capsys.readouterr().out


@pytest.mark.compiler
class TestMachinesOnALine:
    @pytest.mark.parametrize("name", [
        # Those that are slow declare fewer faults: the record injects them.
        pytest.param(name, marks=pytest.mark.long if machine.recorded.faults else ())
        for name, machine in machines().items() if machine.faults and machine.fuzz
        and None in machine.faults()])
    def test_resets_and_flips(self, name, tmp_path, capsys):
        faults = machines()[name].faults
        assert faults is not None
        builds = [f"{name}-{kind}" if kind else name for kind in faults()]
        status, found = run_json(tmp_path / "it.json", "resets", "--machine", name,
                                 "--resets", 200, "--jobs", 1)
        assert status == 0 and [machine["machine"] for machine in found] == builds
        for machine in found:
            assert (machine["resets"], machine["wrong"]) == (200, [])
            coarse = name == "vplotter"  # its strings are
            assert machine["steps"] > (500 if coarse else 1000)
        right = "every coil word legal" if name in ("single", "vplotter") else "every pulse whole"
        assert capsys.readouterr().out.count(f"{right}, none moved") == len(builds)
        status, found = run_json(tmp_path / "it.json", "flips", "--machine", name,
                                 "--flips", 300, "--jobs", 1)
        assert status == 0 and [machine["machine"] for machine in found] == builds
        for machine in found:
            assert machine["flips"] == 300
            assert machine["harmless"] > 200 and machine["visible"] and machine["silent"]


class TestCommand:
    def test_cost(self, monkeypatch, tmp_path, capsys):
        def count(text: str, top: str, progress) -> Resources:
            return Resources(len(re.findall("^module", text, re.M)), 0, 7, 0, 0, "wc")

        monkeypatch.setattr(faults, "synthesise", count)
        status, (plain, guarded) = run_json(tmp_path / "it.json", "cost")
        assert status == 0
        assert guarded["luts"] > 1.5 * plain["luts"]
        assert f"with guard     {guarded['luts']} LUTs, 7 flip-flops" in capsys.readouterr().out

    @pytest.mark.parametrize(("arguments", "message"), [
        ([], "the following arguments are required: FAULT"),
        (["bursts"], "invalid choice: 'bursts'"),
        (["flips", "--flips", "0"], "must be a whole number from 1, not '0'"),
        (["resets", "--seed", "-1"], "must be a whole number from 0 to 4294967295, not '-1'"),
        (["resets", "--json", "nowhere/it.json"], "its folder does not exist"),
        (["flips", "--machine", "lathe"], "invalid choice: 'lathe'"),
        (["resets", "--machine", "single", "--guard"], "leave out --guard: single has none"),
        (["cost", "--guard"], "unrecognized arguments: --guard"),
    ])
    def test_misuse(self, arguments, message, capsys):
        assert run(*arguments) == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1

    def test_nothing_to_run_it_with(self, monkeypatch, capsys):
        monkeypatch.setattr(faults, "missing", lambda: "CXXRTL needs a C++ compiler: install g++")
        assert run("flips") == 2
        assert capsys.readouterr().err == "error: CXXRTL needs a C++ compiler: install g++\n"


class TestBuild:
    def test_guard_is_built_in(self, tmp_path):
        for board in ("pins", "nexys2-500"):
            for option in ([], ["--guard"]):
                out = tmp_path / board
                orders = [] if board == "pins" else ["--orders", "square"]
                assert build.main(["--board", board, *orders, *option, "--no-report", "-o",
                                   str(out)]) == 0
                assert json.loads((out / "report.json").read_text())["guard"] == bool(option)
                modules = re.findall(r"^module (\w*controller__shadow)\(", (
                    out / "mill.v").read_text(), re.M)
                assert len(modules) == len(option)
