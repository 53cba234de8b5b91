"""The registry of machines: those of a folder are known to every command, and to nothing before."""

import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from tb.__main__ import main as bench_command
from tb.machine import Machine
from tb.machines import VARIABLE, added, machines, split_option
from tb.uart import decode_output, high, levels
from tools import (
    build,
    cosim,
    coverage,
    diagrams,
    fingerprints,
    fuzz,
    mutate,
    netlist,
    prove,
    record,
    simulate,
    vhdl,
)
from tools.faults import __main__ as faults
from tools.machines.job import build as build_declared
from tools.serve import machines as serving
from tools.serve.__main__ import main as serve

PAGE = Path(__file__).parents[2] / "docs" / "adding-a-machine.md"


def declare(folder: Path, name: str, text: str) -> Path:
    """Write the declaration of a machine; give the folder."""
    (folder / name).mkdir()
    (folder / name / "__init__.py").write_text(text)
    return folder


class TestFolders:
    @pytest.mark.parametrize(("text", "message"), [
        ("", "{file} has no MACHINE, a value of tb.machine.Machine"),
        ("import nothing_of_that_name", "{file}: ModuleNotFoundError: No module named "),
        ("from tb.machines.mill import MACHINE", "{file}: the machine is named mill, its folder m"),
    ])
    def test_a_wrong_declaration_is_named(self, tmp_path, text, message):
        file = declare(tmp_path, "m", text) / "m" / "__init__.py"
        before = machines()
        with pytest.raises(ValueError) as raised, added([tmp_path]):
            pass
        assert str(raised.value).startswith(message.format(file=file))
        assert list(machines()) == list(before)
        assert VARIABLE not in os.environ

    def test_a_name_is_given_once(self, tmp_path):
        declare(tmp_path, "mill", "from tb.machines.mill import MACHINE")
        with pytest.raises(ValueError, match="there is a machine mill already"), added([tmp_path]):
            pass

    @pytest.mark.parametrize(("folder", "message"), [
        ("nowhere", "is no folder of machines"), (".", "holds no machine")])
    def test_a_folder_without_machines(self, tmp_path, folder, message):
        with pytest.raises(ValueError, match=message), added([tmp_path / folder]):
            pass

    def test_the_option_is_taken_out(self):
        words = ["--machines", "a", "lines", "--machines=b", "--seed", "3", "--", "--machines"]
        assert split_option(words) == (["a", "b"], ["lines", "--seed", "3", "--", "--machines"])
        with pytest.raises(ValueError, match="--machines wants a folder"):
            split_option(["lines", "--machines"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Write the machines of docs/adding-a-machine.md into a folder."""
    folder = tmp_path_factory.mktemp("machines")
    for machine, name, text in re.findall(
            r"^`(\w+)/(\w+\.py)`.*?^```python\n(.*?)^```", PAGE.read_text(), re.M | re.S):
        (folder / machine).mkdir(exist_ok=True)
        (folder / machine / name).write_text(text)
    return folder


class TestMachineOfThePage:
    def test_it_is_known_only_there(self, folder):
        before = list(machines())
        with added([folder]):
            assert list(machines()) == [*before, "nudger", "pulser"]
            assert list(machines()["pulser"].builds) == ["pulser", "pulser-slow"]
        assert list(machines()) == before

    @pytest.mark.usefixtures("libraries")
    def test_cosim(self, folder, capsys):
        for name in ("pulser", "pulser-slow"):
            assert cosim.main(["--machines", str(folder), "--machine", name, "--engines",
                               "model,amaranth", "--cycles", "600"]) == 0
            assert "agree      1 outputs" in capsys.readouterr().out
        assert cosim.main(["--machine", "pulser"]) == 2
        assert "invalid choice: 'pulser'" in capsys.readouterr().err

    @pytest.mark.usefixtures("libraries")
    def test_a_mistake_in_its_gateware_is_found(self, folder, tmp_path, capsys):
        wrong = shutil.copytree(folder, tmp_path / "wrong",
                                ignore=shutil.ignore_patterns("__pycache__"))
        gateware = wrong / "pulser" / "gateware.py"
        gateware.write_text(gateware.read_text().replace("self.period - 1", "self.period - 2"))
        assert cosim.main(["--machines", str(wrong), "--machine", "pulser", "--engines",
                           "model,amaranth", "--cycles", "600", "--vcd",
                           str(tmp_path / "bug")]) == 1
        assert "amaranth differs from model at clock 1: pulse is 0x1, not 0x0" in (
            capsys.readouterr().out)
        assert bench_command(["--machines", str(wrong), "pulser"]) == 1

    def test_benches(self, folder, capsys):
        assert bench_command(["--machines", str(folder), "pulser"]) == 0
        assert "a pulse in every third clock" in capsys.readouterr().out
        assert bench_command(["--machines", str(folder)]) == 0
        assert "  pulser  " in capsys.readouterr().out

    def test_diagrams(self, folder):
        with added([folder]):
            (diagram,) = (each for each in diagrams.diagrams() if each.bench == "pulser")
            assert "<svg" in diagrams.svg(diagram)

    def test_build(self, folder, tmp_path, capsys):
        arguments = ["--machines", str(folder), "--machine", "pulser", "--no-report", "-o",
                     str(tmp_path / "out")]
        assert build.main([*arguments, "--board", "pins", "--rate", "500"]) == 0
        assert "module pulser(" in (tmp_path / "out" / "pulser.v").read_text()
        assert build.main([*arguments, "--board", "pins", "--rate", "900000000"]) == 2
        assert "rate must be at most" in capsys.readouterr().err
        assert build.main(arguments) == 2
        assert "build it with --board pins" in capsys.readouterr().err

    @pytest.mark.verilator
    @pytest.mark.compiler
    @pytest.mark.long
    def test_coverage(self, folder):
        assert coverage.main(["lines", "--machines", str(folder), "--machine", "pulser"]) == 0

    @pytest.mark.parametrize("run", [
        lambda *machines: serve([*machines, "pulser"]),
        lambda *machines: fuzz.main([*machines, "pulser"]),
        lambda *machines: faults.main(["resets", *machines, "--machine", "pulser"]),
    ])
    def test_a_machine_without_a_line_is_refused(self, run, folder, capsys):
        assert run("--machines", str(folder)) == 2
        assert capsys.readouterr().err == "error: pulser has no serial line\n"

    def test_without_real_times_it_is_built_with_short_ones(self, folder, tmp_path):
        with added([folder]):
            machine = machines()["pulser"]
            plain = Machine(name="pulser", about="", make=machine.make, short={"period": 5},
                            directed=machine.directed, random=machine.random)
            assert build_declared("pins", plain).top == "pulser"

    @pytest.mark.parametrize("main", [vhdl.main, simulate.main])
    def test_commands_of_no_machine_refuse_the_option(self, main, folder, capsys):
        assert main(["--machines", str(folder)]) == 2
        assert "--machines has no meaning here" in capsys.readouterr().err


@pytest.fixture
def nudger(folder) -> list[str]:
    """Return the option with which commands know the machine with a serial line."""
    return ["--machines", str(folder)]


class TestMachineWithALine:
    """Every command on a machine that was declared in a folder, with small numbers."""

    @pytest.mark.compiler
    @pytest.mark.usefixtures("libraries")
    def test_cosim(self, nudger, capsys):
        assert cosim.main([*nudger, "--machine", "nudger", "--engines", "amaranth",
                           "--cycles", "600"]) == 2  # an engine alone has nothing to agree with
        capsys.readouterr()
        assert cosim.main([*nudger, "--machine", "nudger", "--engines", "amaranth,cxxrtl",
                           "--cycles", "600"]) == 0
        assert "agree      4 outputs" in capsys.readouterr().out

    def test_benches_and_diagrams(self, nudger, folder):
        assert bench_command([*nudger, "nudger"]) == 0
        with added([folder]):
            (diagram,) = (each for each in diagrams.diagrams() if each.bench == "nudger")
            assert "<svg" in diagrams.svg(diagram)

    def test_build(self, nudger, tmp_path):
        assert build.main([*nudger, "--machine", "nudger", "--board", "pins", "--no-report",
                           "--baud", "19200", "-o", str(tmp_path / "out")]) == 0

    def test_record(self, nudger, folder, capsys):
        assert record.main([*nudger, "--list"]) == 0
        listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
        own = {"engines-nudger", "pair-nudger", "fuzz-nudger", "mutants-nudger", "resets-nudger",
               "flips-nudger", "coverage-nudger", "size-nudger"}
        assert own <= {*listed}
        with added([folder]):
            wanted = [name for part in own for name in record.parts()[part].depends()]
            assert {"contract nudger", "bench nudger"} <= {*wanted}
            assert "gone" not in fingerprints.take(wanted, 1).values()

    @pytest.mark.prover
    @pytest.mark.long
    def test_prove_and_mutate(self, nudger, tmp_path, capsys):
        assert prove.main([*nudger, "nudger"]) == 0
        assert prove.main([*nudger, "nudger", "--mutants"]) == 0
        assert mutate.main([*nudger, "--machine", "nudger", "--mutants", "6", "--least", "0",
                            "--jobs", "1", "--state", str(tmp_path / "state.json")]) == 0
        assert re.search(r"^nudger +6 ", capsys.readouterr().out, re.M)

    @pytest.mark.compiler
    @pytest.mark.long
    @pytest.mark.usefixtures("libraries")
    def test_fuzz_and_faults(self, nudger, tmp_path):
        assert fuzz.main([*nudger, "nudger", "--bytes", "600", "--save",
                          str(tmp_path / "found")]) == 0
        for what in ("resets", "upsets"):
            assert faults.main([what, *nudger, "--machine", "nudger", f"--{what}", "40",
                                "--jobs", "1"]) == 0

    @pytest.mark.icarus
    @pytest.mark.long
    @pytest.mark.usefixtures("libraries")
    def test_netlist(self, nudger, capsys):
        assert netlist.main([*nudger, "--machine", "nudger", "--flips", "1", "--cycles", "50"]) == 0
        assert "4 of 4 as they must be" in capsys.readouterr().out

    @pytest.mark.usefixtures("libraries")
    def test_serve(self, nudger, folder):
        with pytest.raises(SystemExit):
            serve([*nudger, "nudger", "--help"])
        with added([folder]):
            engine, bit = serving.build(serving.servable()["nudger"], "amaranth")
            line = np.concatenate([high(4 * bit), levels(b"+", bit), high(12 * bit)])
            seen = engine.apply({"rx": line}, ["tx"])
            engine.close()
        assert decode_output(seen["tx"], bit).text == b"+"
