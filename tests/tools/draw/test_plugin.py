"""The command of vpype: real pipelines, with the entry point that pyproject.toml has."""

import pytest

from tests.tools.draw.drawings import write
from tools.draw import __main__ as command

pytestmark = pytest.mark.vpype

LAYERS = """<g inkscape:groupmode="layer" inkscape:label="Sky" stroke="blue" fill="none">
      <path d="M0 0L50 50"/><path d="M60 60V90"/></g>
    <g inkscape:groupmode="layer" inkscape:label="Sea" stroke="green" fill="none">
      <path d="M100 100L0 100"/></g>"""


def test_a_pipeline_writes_what_the_command_does(vpype, tmp_path):
    path = write(tmp_path, LAYERS)
    done = vpype("read", path, "linesort", "fresa", "--feed", "1800", "out.gcode")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "out.gcode").read_text()
    assert command.main([str(path), "--out", str(tmp_path / "own.gcode"), "--sort", "own"]) == 0
    own = (tmp_path / "own.gcode").read_text()

    def ends(program):  # of lines, whichever is drawn first, and from which end
        words = program.replace("Sky", "").replace("Sea", "").splitlines()
        return sorted(word for line in words for word in line.split() if word[0] in "XY")

    assert "(pen 1 of 2: Sky)" in text and "M0 (change to pen 2: Sea)" in text
    for value in (100, 1668, 1568):
        assert text.count(f"X{value}\n") == own.count(f"X{value}\n")
    assert set(ends(text)) == set(ends(own))


def test_size_and_place(vpype, tmp_path):
    done = vpype("line", "0", "0", "10cm", "0", "fresa", "--own-size", "--at", 500, 700, "a.gcode")
    assert done.returncode == 0, done.stderr
    assert "G0 X500 Y1068\nM3 S1000\nG1 X600 F1800\nM5" in (tmp_path / "a.gcode").read_text()


@pytest.mark.parametrize(("arguments", "message"), [
    (["fresa", "a.gcode"], "there are no lines to draw"),
    (["line", "0", "0", "5", "5", "fresa", "--width", "5000", "a.gcode"], "beyond the area"),
    (["line", "0", "0", "5", "5", "fresa", "no/a.gcode"], "its folder does not exist"),
    *((["line", "0", "0", "5", "5", "fresa", *words, "a.gcode"], message) for words, message in (
        (["--feed", "0"], "0.0 is not in the range"), (["--margin", "-100"], "is not in the range"),
        (["--dwell", "1e30"], "is not in the range"), (["--top", "nan"], "is not a number"),
        (["--width", "5", "--own-size"], "say two sizes"), (["--rest", "9", "9"], "is above"))),
])
def test_what_is_refused_writes_nothing(vpype, tmp_path, arguments, message):
    done = vpype(*arguments)
    assert done.returncode == 2 and message in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "a.gcode").exists()


def test_help_lists_it(vpype):
    assert "fresa" in vpype("--help").stdout
    assert "vpype read drawing.svg linemerge linesort fresa" in vpype("fresa", "--help").stdout
