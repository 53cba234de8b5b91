"""The commands of docs/vplotter.md do what it says."""

import re
import shlex
from pathlib import Path

import pytest

from tools.draw import __main__ as command

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "docs" / "vplotter.md").read_text(encoding="utf-8")
DRAWINGS = TEXT.partition("## Drawings\n")[2].partition("\n## ")[0]
COMMANDS = [shlex.split(line) for block in re.findall(r"```sh\n(.*?)```", DRAWINGS, re.S)
            for line in block.replace("\\\n", " ").splitlines()]


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_flower(folder, capsys):
    (*python, module), arguments = COMMANDS[0][:3], COMMANDS[0][3:]
    assert python == ["python", "-m"] and module == "tools.draw"
    assert command.main(arguments) == 0
    assert {path.name for path in folder.iterdir()} == {"examples", "flower.gcode", "flower.png"}
    out = capsys.readouterr().out
    before, after = (float(each) for each in re.findall(r"([\d.]+) m with the pen up become "
                                                        r"([\d.]+) m", DRAWINGS)[0])
    found = re.search(r"^([\d.]+) m with the pen up, ([\d.]+) m in the order", out, re.M)
    assert found and float(found[2]) == pytest.approx(before, abs=0.06)
    assert float(found[1]) == pytest.approx(after, abs=0.15)  # with vpype or without


@pytest.mark.vpype
def test_the_pipeline_of_vpype(folder, vpype):
    (program, *arguments), = (each for each in COMMANDS if each[0] == "vpype")
    done = vpype(*arguments)
    assert program == "vpype" and done.returncode == 0, done.stderr
    assert "M0 (change to pen 2: Bloom)" in (folder / "flower.gcode").read_text()


def test_every_option_of_the_page_is_one(capsys):
    with pytest.raises(SystemExit):
        command.main(["--help"])
    known = set(re.findall(r"--[\w-]+", capsys.readouterr().out))
    named = set(re.findall(r"`(--[\w-]+)", DRAWINGS))
    assert len(named) >= 15 and named <= known
