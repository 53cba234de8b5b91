"""The command that shows the panel."""

import sys

import pytest

from tools.panel.__main__ import main


@pytest.mark.parametrize(("arguments", "message"), [
    (["--backlash", "1", "2", "3"], "a machine at a PORT has the options that it was built with"),
    (["--simulate", "--original"], "with --original the machine does not answer"),
    (["--simulate", "--top-speed", "1499"], "up to 1500 steps/s: --top-speed must not be less"),
    (["/dev/ttyUSB0", "--simulate"], "with --simulate there is no PORT: leave out one of them"),
    (["--port", "70000"], "must be a whole number from 0 to 65535, not '70000'"),
    (["a", "b"], "unrecognized arguments: b"),
])
def test_mistakes_are_one_line(arguments, message, capsys):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and message in err


def test_without_a_compiler_there_is_no_simulation(monkeypatch, capsys):
    monkeypatch.setenv("CXX", "no-such-compiler")
    assert main(["--simulate"]) == 2
    assert "needs a C++ compiler" in capsys.readouterr().err


def test_without_pyserial_it_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "serial", None)
    assert main([]) == 2
    assert "pip install -e '.[host]'" in capsys.readouterr().err


def test_the_file_of_somebody_else_is_left_alone(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    (tmp_path / "fresa" / "panel.json").mkdir(parents=True)
    assert main([]) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and "panel.json" in err
