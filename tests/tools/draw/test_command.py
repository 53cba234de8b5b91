"""The command: what it prints and writes, and what it refuses."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.tools.draw.drawings import write
from tools.draw import __main__ as command
from tools.draw.order import vpype_missing

ROOT = Path(__file__).parents[3]
DRAWING = """
    <g inkscape:groupmode="layer" inkscape:label="Frame"><rect width="90" height="80"/></g>
    <g inkscape:groupmode="layer" inkscape:label="Dots" fill="red">
      <circle cx="20" cy="20" r="5"/><circle cx="70" cy="60" r="5"/>
      <circle cx="70" cy="60" r="5"/></g>"""


@pytest.fixture
def drawing(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write(tmp_path, DRAWING)


def run(*arguments: object) -> int:
    return command.main([str(each) for each in (*arguments, "--effort", "0.1")])


def test_a_summary_writes_nothing(drawing, capsys):
    assert run(drawing, "--sort", "own") == 0
    out, err = capsys.readouterr()
    assert not err and [path.name for path in drawing.parent.iterdir()] == ["drawing.svg"]
    first, second, third, *pens, last = out.splitlines()
    assert first.startswith("1568.0 x 1393.8 mm on the wall, from 100.0,237.1 on; 65.85 times")
    assert second.startswith("3 lines, ") and second.endswith("1 line drawn once, not twice")
    assert " in the order of the file, " in third and "(nearest neighbour and two-opt)" in third
    assert [pen.split(",")[0] for pen in pens] == ["pen 1: Frame", "pen 2: Dots"]
    assert last.startswith("about ") and last.endswith("without the changes of pens")


def test_all_that_it_writes(drawing, capsys):
    assert run(drawing, "--out", "a.gcode", "--png", "a.png", "--json", "a.json", "--original",
               "a.txt") == 0
    out = capsys.readouterr().out
    names = ["a.gcode", "a-1.txt", "a-2.txt", "a.png", "a.json"]
    assert [line for line in out.splitlines() if "wrote" in line] == [f"wrote {n}" for n in names]
    assert {path.name for path in Path().iterdir()} == {"drawing.svg", *names}
    text = Path("a.gcode").read_text()
    assert text.startswith("G21 G90 G94 G54\nM5\n(pen 1 of 2: Frame)\n")
    assert text.count("\nM0 (change to pen 2: Dots)\n") == 1 and text.endswith("G0 X884 Y884\nM2\n")
    assert Path("a-1.txt").read_text().startswith(":P1\n:H\n:I")
    facts = json.loads(Path("a.json").read_text())
    assert facts["lines"] == 3 and facts["twice"] == 1 and len(facts["pens"]) == 2
    frame = 2 * (1568 + 1568 * 80 / 90)
    assert facts["pens"][0]["down_mm"] == pytest.approx(frame, abs=0.1)
    assert facts["seconds"] == pytest.approx(facts["seconds_down"] + facts["seconds_up"], abs=0.2)
    assert facts["seconds_down"] > facts["down_mm"] / 30
    with Image.open("a.png") as image:
        assert image.size[0] > 1000


def test_one_pen_is_one_list(drawing):
    assert run(drawing, "--pens", "one", "--original", "a.txt") == 0
    assert {path.name for path in Path().iterdir()} == {"drawing.svg", "a.txt"}


def test_size_and_place(drawing, capsys):
    assert run(drawing, "--own-size", "--at", "500,700") == 0
    assert capsys.readouterr().out.startswith(
        "23.8 x 21.2 mm on the wall, from 500.0,700.0 on; 1 times its own size")
    assert run(drawing, "--width", "450", "--wall", "1000x800", "--margin", "10", "--top", "0") == 0
    assert capsys.readouterr().out.startswith("450.0 x 400.0 mm on the wall, from 275.0,195.0 on")


def test_what_is_not_drawn_is_said(tmp_path, capsys):
    path = write(tmp_path, DRAWING + '<image href="a.png" width="1" height="1"/>')
    assert run(path) == 0
    assert capsys.readouterr().err == "note: not as it looks: image\n"


@pytest.mark.parametrize(("arguments", "message"), [
    (["none.svg"], "none.svg: No such file or directory"),
    (["."], "Is a directory"),
    (["text.svg", "--out", "a.gcode"], "has text, 'A': convert text to paths"),
    (["empty.svg"], "empty.svg is empty"),
    (["drawing.svg", "--png", "a.jpg"], "would be a PNG file"),
    (["drawing.svg", "--out", "drawing.svg"], "drawing.svg is what is read"),
    (["drawing.svg", "--out", "a", "--json", "a"], "a is used twice"),
    (["drawing.svg", "--out", "no/a.gcode"], "its folder does not exist"),
    (["drawing.svg", "--original", "taken.svg"], "cannot write taken-1.svg: it is a folder"),
    (["drawing.svg", "--width", "5000", "--out", "a.gcode"], "beyond the area"),
    (["drawing.svg", "--width", "5", "--own-size"], "not allowed with argument"),
    (["drawing.svg", "--width", "nan"], "must be a number from 0.001 to 100000, not 'nan'"),
    (["drawing.svg", "--wall", "wide"], "must be a number from 1 to 100000, not 'wide'"),
    (["drawing.svg", "--wall", "1x2x3"], "must be such as 1768x1768"),
    (["drawing.svg", "--at", "5"], "must be such as 500,700"),
    (["drawing.svg", "--wall", "300"], "leave no place"),
    (["drawing.svg", "--rest", "5000,5"], "is not on the wall"),
    (["drawing.svg", "--home"], "--home is that of --to"),
    (["drawing.svg", "--original", "a", "--out", "a-2"], "a-2 is used twice"),
    (["drawing.svg", "--original", "a", "--json", "a-1"], "a-1 is used twice"),
    (["drawing.svg", "--wall", "12000", "--original", "a.txt"], "four digits"),
    (["drawing.svg", "--feed", "0"], "must be a number from 1 to"),
    (["drawing.svg", "--to", "/dev/no-such-port", "--pens", "one"], "cannot be opened"),
    ([], "the following arguments are required: FILE.svg"),
])
def test_what_is_refused_is_one_line_and_writes_nothing(drawing, capsys, arguments, message):
    Path("text.svg").write_text(drawing.read_text().replace("</svg>", "<text>A</text></svg>"))
    Path("empty.svg").touch()
    Path("taken-1.svg").mkdir()
    before = sorted(Path().iterdir())
    assert run(*arguments) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ") and err.count("\n") == 1 and message in err
    assert sorted(Path().iterdir()) == before


def test_a_missing_library_is_named(drawing, monkeypatch, capsys):
    monkeypatch.delitem(sys.modules, "tools.draw.svg")
    monkeypatch.setitem(sys.modules, "svgelements", None)
    assert run(drawing) == 2
    assert capsys.readouterr().err == (
        "error: svgelements is missing: pip install -e '.[draw]'\n")


def test_vpype_that_is_missing_is_named(drawing, monkeypatch, capsys):
    monkeypatch.setattr("tools.draw.order.vpype_missing", lambda: "vpype missing: install it")
    assert run(drawing, "--sort", "vpype") == 2
    assert capsys.readouterr().err == "error: vpype missing: install it\n"
    assert run(drawing) == 0  # sorts by itself then
    assert "nearest neighbour" in capsys.readouterr().out
    assert vpype_missing() in (None, "vpype missing: pip install -e '.[vpype]'")


def test_help_teaches(capsys):
    done = subprocess.run([sys.executable, "-m", "tools.draw", "--help"], cwd=ROOT, text=True,
                          capture_output=True)
    assert done.returncode == 0 and "examples:\n" in done.stdout
    assert max(map(len, ABOUT := command.ABOUT.splitlines())) <= 100 and ABOUT
