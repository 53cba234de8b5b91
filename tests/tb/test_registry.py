"""The registry of machines: those of a folder are known to every command, and to nothing before."""

import os
import re
import shutil
from pathlib import Path

import pytest

from tb.__main__ import main as bench_command
from tb.engines.coverage import CoverageEngine
from tb.machines import VARIABLE, added, machines, split_option
from tools import build, cosim, coverage, diagrams
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
    """Write the machine of docs/adding-a-machine.md into a folder."""
    folder = tmp_path_factory.mktemp("machines")
    (folder / "pulser").mkdir()
    for name, text in re.findall(r"^`pulser/(\w+\.py)`.*?^```python\n(.*?)^```", PAGE.read_text(),
                                 re.M | re.S):
        (folder / "pulser" / name).write_text(text)
    return folder


class TestMachineOfThePage:
    def test_it_is_known_only_there(self, folder):
        before = list(machines())
        with added([folder]):
            assert list(machines()) == [*before, "pulser"]
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
        wrong = shutil.copytree(folder, tmp_path / "wrong")
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
    def test_coverage(self, folder):
        if reason := CoverageEngine.missing():
            pytest.skip(reason)
        assert coverage.main(["lines", "--machines", str(folder), "--machine", "pulser"]) == 0

    def test_serve_says_that_it_has_no_line(self, folder, capsys):
        assert serve(["--machines", str(folder), "pulser"]) == 2
        assert capsys.readouterr().err == "error: pulser has no serial line\n"
