"""The command that mills a picture in simulation."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tools import simulate
from tools.cut_picture import AIR, IN_ERROR, MISSED, duration

RING = ["#####", "#...#", "#.#.#", "#...#", "#####"]


@pytest.fixture
def ring(tmp_path) -> Path:
    """Give a ring of 16 pixels around one."""
    path = tmp_path / "ring.png"
    Image.fromarray(np.array([[c != "#" for c in row] for row in RING])).save(path)
    return path


@pytest.fixture
def dot(tmp_path) -> Path:
    """Give a picture of one pixel, which takes a third of the time of the ring."""
    path = tmp_path / "dot.png"
    Image.new("1", (1, 1)).save(path)
    return path


def run(*arguments: object) -> int:
    return simulate.main([str(argument) for argument in arguments])


def colours(path: Path) -> set:
    image = Image.open(path).convert("RGB")
    return {colour for _, colour in image.getcolors(1 << 20) or []}


@pytest.mark.parametrize("engine", [
    "amaranth", pytest.param("cxxrtl", marks=pytest.mark.compiler)])
class TestEngines:
    def test_ring(self, tmp_path, ring, engine, capsys):
        png, figures = tmp_path / "cut.png", tmp_path / "cut.json"
        assert run("--image", ring, "--png", png, "--json", figures, "--engine", engine) == 0
        assert "17 requested, 17 cut, 0 missed, 0 cut in error" in capsys.readouterr().out
        assert AIR in colours(png)
        assert not {MISSED, IN_ERROR} & colours(png)
        facts = json.loads(figures.read_text())
        # Down and up for the ring and for the dot; the way between them and home is in the air.
        assert facts["strokes"] == 2
        assert facts["steps"]["z"] == 4 * 1152
        assert facts["engine"] == engine
        assert facts["air_steps"] > 0
        assert facts["job_seconds"] == pytest.approx(
            steps_made(facts) / 101.376, rel=0.01)


def test_period_changes_the_clocks_and_not_the_cut(tmp_path, dot):
    facts = []
    for period in (1, 3):
        run("--image", dot, "--png", tmp_path / "cut.png", "--json", tmp_path / "cut.json",
            "--engine", "amaranth", "--period", period)
        facts.append(json.loads((tmp_path / "cut.json").read_text()))
    one, three = facts
    assert three["least_period"] == 3
    assert three["clocks"] > 2 * one["clocks"]
    same = ("pixels_cut", "steps", "air_steps", "milled_mm", "strokes")
    assert [one[key] for key in same] == [three[key] for key in same]
    assert three["job_seconds"] == pytest.approx(one["job_seconds"], abs=1e-3)


def steps_made(facts: dict) -> float:
    """Count steps in time: a diagonal is one, and 16 pixels of ring have no diagonal."""
    return facts["air_steps"] + 15 * 128 + facts["steps"]["z"]


def test_step_rate_sets_the_time(tmp_path, dot, capsys, monkeypatch):
    rates = []
    real = simulate.draw_cut
    monkeypatch.setattr(
        simulate, "draw_cut", lambda cut, rate: rates.append(rate) or real(cut, rate))
    times = []
    for rate in (101.376, 50.688):
        assert run("--image", dot, "--png", tmp_path / "cut.png", "--json", tmp_path / "cut.json",
                   "--engine", "amaranth", "--step-rate", rate) == 0
        times.append(json.loads((tmp_path / "cut.json").read_text())["job_seconds"])
        assert f"time       {duration(times[-1])} on the machine" in capsys.readouterr().out
    assert times[1] == pytest.approx(2 * times[0], rel=0.001)
    assert [float(rate) for rate in rates] == [101.376, 50.688]


class TestWaveform:
    def test_names_of_states(self, tmp_path, ring):
        vcd = tmp_path / "ring.vcd"
        assert run("--image", ring, "--png", tmp_path / "cut.png", "--vcd", vcd,
                   "--engine", "amaranth", "--size", "2x2") == 0
        text = vcd.read_text()
        assert "coordinates_state" in text
        assert "SEARCH" in text

    def test_whole_or_not_at_all(self, tmp_path, ring, monkeypatch):
        def fail(*_, **__):
            raise KeyboardInterrupt

        monkeypatch.setattr(simulate, "run_job", fail)
        before = sorted(tmp_path.iterdir())
        assert run("--image", ring, "--vcd", tmp_path / "a.vcd", "--engine", "amaranth") == 130
        assert sorted(tmp_path.iterdir()) == before

    @pytest.mark.parametrize("option", ["--png", "--json", "--vcd"])
    def test_places_are_looked_at_first(self, tmp_path, ring, capsys, monkeypatch, option):
        monkeypatch.setattr(simulate, "simulate", None)  # never called
        assert run("--image", ring, option, tmp_path / "none" / "a.png") == 2
        assert "its folder does not exist" in capsys.readouterr().err

    def test_folder_must_exist(self, tmp_path, ring, capsys):
        assert run("--image", ring, "--vcd", tmp_path / "none" / "a.vcd") == 2
        assert "its folder does not exist" in capsys.readouterr().err


class TestNoCompiler:
    @pytest.mark.parametrize("compiler", ["false", "/nowhere/g++"])
    def test_goes_on_with_the_slow_engine(self, tmp_path, dot, monkeypatch, capsys, compiler):
        monkeypatch.setenv("CXX", compiler)
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))  # nothing compiled before
        monkeypatch.setenv("YOWASP_CACHE_DIR", str(Path.home() / ".cache" / "YoWASP"))
        assert run("--image", dot, "--png", tmp_path / "cut.png") == 0
        printed = capsys.readouterr()
        assert "(amaranth)" in printed.out
        assert printed.err.count("; using the slow engine, amaranth, which takes ") == 1

    def test_says_so_when_asked_for(self, tmp_path, ring, monkeypatch, capsys):
        monkeypatch.setenv("CXX", "/nowhere/g++")
        assert run("--image", ring, "--png", tmp_path / "cut.png", "--engine", "cxxrtl") == 2
        assert capsys.readouterr().err.count("\n") == 1


class TestWrong:
    def test_other_picture_milled(self, tmp_path, ring, monkeypatch, capsys):
        """A plate that is not as asked is drawn as it is, and is an error."""
        names = simulate.ready_to_mill.__globals__
        right = names["CoordinateGenerator"]

        def mills_something_else(picture, **how):
            picture[0][0], picture[1][1] = False, True
            return right(picture, **how)

        monkeypatch.setitem(names, "CoordinateGenerator", mills_something_else)
        png = tmp_path / "cut.png"
        assert run("--image", ring, "--png", png, "--engine", "amaranth") == 1
        assert "1 missed" in capsys.readouterr().out
        assert {MISSED, IN_ERROR} <= colours(png)

    @pytest.mark.parametrize("arguments", [
        ["--period", "0"], ["--period", "x"], ["--engine", "vhdl"], ["--png", "cut.txt"],
        ["--step-rate", "-3"],
    ])
    def test_bad_arguments(self, tmp_path, ring, capsys, arguments, monkeypatch):
        monkeypatch.chdir(tmp_path)
        before = sorted(tmp_path.iterdir())
        assert run("--image", ring, *arguments) == 2
        assert capsys.readouterr().err.count("\n") == 1
        assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(("seconds", "text"), [
    (0.25, "0.25 s"), (48, "48 s"), (720, "12 min"), (99 * 60, "99 min"), (11100, "3 h 05 min"),
])
def test_duration(seconds, text):
    assert duration(seconds) == text
