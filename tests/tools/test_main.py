"""The list of commands."""

import subprocess
import sys
from pathlib import Path

import pytest

from tools.__main__ import commands, main

ROOT = Path(__file__).parents[2]


def test_it_lists_every_module_that_is_a_command(capsys):
    assert main([]) == 0
    out = capsys.readouterr().out
    assert {"build", "image", "simulate"} <= set(commands())
    assert not {"console", "picture", "__main__", "__init__"} & set(commands())
    for name, about in commands().items():
        assert about.endswith(".")
        line, = (line for line in out.splitlines() if line.startswith(f"  {name} "))
        assert line.endswith(about) and len(line) <= 100
    assert "python -m tb" in out


def test_a_new_command_is_found_by_itself(tmp_path):
    guard = 'if __name__ == "__main__":\n    pass\n'
    (tmp_path / "new.py").write_text(f'"""Do something new.\n\nAnd more.\n"""\n\n{guard}')
    (tmp_path / "plain.py").write_text(guard)
    (tmp_path / "library.py").write_text('"""What commands share."""\n')
    assert commands(tmp_path) == {"new": "Do something new.", "plain": ""}


@pytest.mark.parametrize(("name", "advice"), [
    ("build", "run python -m tools.build"),
    ("bild", "run python -m tools.build"),
    ("zzz", "there is no command 'zzz'; python -m tools lists them"),
])
def test_the_name_of_a_command_belongs_after_a_dot(name, advice, capsys):
    assert main([name, "--png", "x.png"]) == 2
    out, err = capsys.readouterr()
    assert not out and err == f"error: {advice}\n"


def test_listing_imports_nothing_heavy():
    code = ("import sys, tools.__main__ as m; m.main([])\n"
            "sys.exit(bool({'amaranth', 'numpy', 'PIL', 'tb'} & set(sys.modules)))")
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True)
