"""Every benchmark finds what it measures."""

import importlib
import json
from pathlib import Path

import pytest

import benchmarks
from benchmarks import boards, engines, serving
from benchmarks.pages import with_figures

FILES = sorted(path for path in Path(benchmarks.__path__[0]).glob("*.py")
               if path.stem != "__init__")
COMMANDS = [path.stem for path in FILES if "__main__" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("name", [path.stem for path in FILES])
def test_it_can_be_imported(name):
    assert importlib.import_module(f"benchmarks.{name}").__doc__


@pytest.mark.parametrize("name", COMMANDS)
def test_help_says_how_to_run_it_and_what_is_wrong_is_one_line(name, capsys):
    main = importlib.import_module(f"benchmarks.{name}").main
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    usage, *about = capsys.readouterr().out.splitlines()
    assert usage.startswith(f"usage: python -m benchmarks.{name} [-h]") and len(about) > 6
    assert main(["--no-such-option"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_picture_of_all_engines_has_as_many_pixels_as_it_may():
    for wanted, found in ((1, 1), (engines.MOST_PIXELS, engines.MOST_PIXELS),
                          (engines.MOST_PIXELS + 1, engines.MOST_PIXELS)):
        assert engines.picture(wanted).sum() == found


def test_figures_go_into_a_page_between_their_comments():
    page = "# A\n<!-- table of python -m benchmarks.a -->\nold\n<!-- end of the table -->\nB\n"
    found = with_figures(page, "a", "new\n")
    assert found == page.replace("old", "new")
    for text, name in ((page, "b"), (page.replace("<!-- end", ""), "a")):
        with pytest.raises(ValueError, match=f"has no place for the table of benchmarks.{name}"):
            with_figures(text, name, "new\n")


def test_the_table_of_served_machines_has_the_figures():
    kept = json.loads(serving.FIGURES.read_text(encoding="utf-8"))
    found = [serving.Speed(**each) for each in kept["found"]]
    assert kept["clock_hz"] == serving.CLOCK
    assert [(each.machine, each.line) for each in found] == [
        (name, kind) for name in serving.servable() for kind in serving.KINDS]
    page = serving.PAGE.read_text(encoding="utf-8")
    text = serving.report(kept["clock_hz"], kept["seconds"], kept["rounds"], found)
    assert with_figures(page, "serving", text) == page, "run python -m benchmarks.serving --write"


def test_a_board_that_is_built_keeps_its_figures_if_the_next_one_fails(tmp_path, monkeypatch):
    page, kept = tmp_path / "page.md", tmp_path / "boards.json"
    page.write_text("<!-- table of python -m benchmarks.boards -->\n<!-- end of the table -->\n")
    monkeypatch.setattr(boards, "FIGURES", kept)
    monkeypatch.setattr(boards, "PAGES", (page,))

    def figures(board, machine):
        if board == "ulx3s-25f":
            raise RuntimeError("no place")
        return {"cells": 12, "of": 99, "clock_mhz": 50.0, "fmax_mhz": 75.5, "margin": 0.51}

    monkeypatch.setattr(boards, "figures", figures)
    with pytest.raises(RuntimeError, match="no place"):
        boards.main(["icepi-zero", "ulx3s-25f", "--machine", "mill", "--write"])
    assert json.loads(kept.read_text()) == {"icepi-zero": {"mill": figures("icepi-zero", "mill")}}
    assert "| `icepi-zero`, 99 cells | 50 MHz | 12 cells, 75 MHz, +51% |" in page.read_text()
