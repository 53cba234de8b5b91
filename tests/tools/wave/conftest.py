"""Waves for the tests: written by hand, and of a bench."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tb.benches import benches
from tools.wave.__main__ import main


@pytest.fixture
def vcd(tmp_path) -> Callable[..., Path]:
    """Write a VCD: its declarations as `kind bits id name`, a line each, and its changes."""

    def write(variables: str, changes: str, *, name: str = "a.vcd", timescale: str = "1 ns",
              scope: str = "top") -> Path:
        lines = [f"$timescale {timescale} $end"] if timescale else []
        lines += [f"$scope module {part} $end" for part in scope.split(".")]
        for variable in variables.strip().splitlines():
            if variable.strip().startswith("$"):
                lines.append(variable.strip())
            else:
                lines.append(f"$var {variable.strip()} $end")
        lines += ["$upscope $end" for _ in scope.split(".")] + ["$enddefinitions $end"]
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n" + "\n".join(changes.split("|")) + "\n")
        return path

    return write


@pytest.fixture
def clocked(vcd) -> Path:
    """Give a clock of 10 ns, rising first at 5 ns, and signals that change with it."""
    changes = ["#0", "0!", "b0000 c", 's"REST/0" %'.replace('"', ""), "0r", "bx w"]
    for clock in range(1, 21):
        changes += [f"#{10 * clock - 5}", "1!", f"b{clock % 16:b} c"]
        if clock in (3, 4, 10):
            changes.append("1r")
        if clock in (4, 6, 13):
            changes.append("0r")
        if clock == 5:
            changes += ["sMOVING/1 %", "b101 w"]
        if clock == 12:
            changes += ["sREST/0 %", "bz01 w"]
        changes += [f"#{10 * clock}", "0!"]
    return vcd("wire 1 ! clk\nwire 4 c count\nstring 1 % state\nwire 1 r ready\nwire 3 w word",
               "|".join(changes))


@pytest.fixture(scope="session")
def mill(tmp_path_factory) -> Path:
    """Give the waveform of the bench of the mill."""
    path = tmp_path_factory.mktemp("mill") / "mill.vcd"
    benches()["mill"].run(path)
    return path


@pytest.fixture
def wave(capsys) -> Callable[..., tuple[int, str, str]]:
    """Run the command; give its exit status, and what it wrote to stdout and stderr."""

    def run(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        status = main([str(argument) for argument in arguments])
        return (status, *capsys.readouterr())

    return run
