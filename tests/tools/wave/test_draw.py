"""Timing diagrams: what is drawn where, how much, and the same bytes each time."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from tb.benches import groups
from tools import diagrams
from tools.wave import view
from tools.wave.draw import MOST_ROWS, draw, scene
from tools.wave.figure import Axis, Row, figure
from tools.wave.reader import Wave
from tools.wave.scene import CHARACTER, STYLES
from tools.wave.segments import segments
from tools.wave.trace import collect

SPACE = "{http://www.w3.org/2000/svg}"


def elements(svg: str, style: str) -> list[ET.Element]:
    return [part for part in ET.fromstring(svg).iter() if part.get("class") == style]


def points(element: ET.Element) -> np.ndarray:
    return np.array([[float(n) for n in pair] for pair in re.findall(
        r"(-?[\d.]+) (-?[\d.]+)", element.get("d", ""))])


class TestWhatIsDrawn:
    def test_bits_rise_where_they_rise(self, vcd):
        svg = draw(Wave(vcd("wire 1 a a", "#0|0a|#25|1a|#75|0a|#100|1a")), ["a"])
        line, = elements(svg, "bit")
        path = points(line)
        left, right = path[0][0], path[-1][0]
        low, high = path[:, 1].max(), path[:, 1].min()
        assert low - high == 16
        for time, before, after in ((25, low, high), (75, high, low)):
            x = left + time / 100 * (right - left)
            assert path[path[:, 0] <= x + 0.1][-1][1] == before
            assert path[path[:, 0] > x + 0.1][0][1] == after

    def test_values_stand_in_their_hexagons_and_never_overlap(self, vcd):
        """Numbers that do not fit are left out, names are shortened."""
        changes, time = [], 0
        for n in range(24):
            changes += [f"#{time}", f"b{n * 1000:b} a", f"sSTATE-{n}/1 b"]
            time += 1 + 3 * (n % 12)
        wave = Wave(vcd("wire 16 a number\nstring 1 b state\nwire 1 e end",
                        "|".join([*changes, f"#{time}|1e"])))
        svg = draw(wave, ["number", "state"])
        boxes = [(points(box)[:, 0].min(), points(box)[:, 0].max(), points(box)[:, 1].mean())
                 for style in ("bus", "state") for box in elements(svg, style)]
        texts = elements(svg, "value")
        assert len(boxes) > len(texts) >= 20
        for text in texts:
            x, y = float(text.get("x", "")), float(text.get("y", ""))
            half = len(text.text or "") * CHARACTER / 2
            assert any(left <= x - half and x + half <= right and abs(y - at) < 1
                       for left, right, at in boxes), text.text
        words = {text.text for text in texts}
        assert {"11000", "23000", "STATE-11", "STATE-23"} <= words
        assert all(re.fullmatch(r"\d+000|0|STATE-\d+|S\w*-?\d*…", str(word)) for word in words)

    def test_unknown_is_hatched(self, vcd):
        svg = draw(Wave(vcd("wire 1 a a\nwire 4 b b", "#0|xa|bx b|#50|1a|b1 b|#100|0a")),
                   ["a", "b"])
        shapes = elements(svg, "unknown")
        closed = [shape for shape in shapes if (shape.get("d") or "").endswith("Z")]
        assert len(closed) == 2
        lines = [points(shape) for shape in shapes if shape not in closed]
        inside = [sum(bool((line >= points(box).min(axis=0)).all()
                           and (line <= points(box).max(axis=0)).all()) for line in lines)
                  for box in closed]
        assert min(inside) > 20 and sum(inside) == len(lines)

    def test_a_curve_has_the_heights_of_its_values(self, vcd):
        path = vcd("wire 8 a at_x", "#0|b0 a|#10|b1010 a|#20|b11110110 a|#30|b0 a|#40|b1 a")
        svg = draw(Wave(path), ["at_x"], analog=["at_x"])
        line, = elements(svg, "curve")
        y = points(line)[:, 1]
        zero = y[0]
        assert zero - y.min() == pytest.approx(y.max() - zero, abs=0.2)  # 10 and -10
        assert {text.text for text in elements(svg, "note")} >= {"10", "-10", "ns"}

    def test_headings_names_and_axis(self, clocked):
        svg = draw(Wave(clocked), ["in:", "clk", "out:", "count", "state"], "2clk", "12clk",
                   cycles=True, title="A & <B>\a")
        assert [text.text for text in elements(svg, "group")] == ["in", "out"]
        assert [text.text for text in elements(svg, "name")] == ["clk", "count", "state"]
        assert [text.text for text in elements(svg, "title")] == ["A & <B>\\x07"]
        notes = [text.text for text in elements(svg, "note")]
        assert notes == ["clocks", *map(str, range(2, 13))]
        root = ET.fromstring(svg)
        assert root.findtext(f"{SPACE}title") == "A & <B>\\x07"
        assert "count" in str(root.findtext(f"{SPACE}desc"))

    def test_axis_of_time(self, vcd):
        wave = Wave(vcd("wire 1 a a", "#0|0a|#1500|1a|#4000|0a"))
        notes = [text.text for text in elements(draw(wave, ["a"]), "note")]
        assert notes[:3] == ["us", "0", "0.5"] and notes[-1] == "4"

    def test_arrays_are_drawn_as_well(self):
        trace = collect([(range(0, 100, 10), [n % 2 for n in range(10)])], 10, kind="bits", bits=1)
        svg = figure([Row("made", trace)], 0, 100, Axis("ticks")).svg()
        assert len(elements(svg, "bit")) == 1


class TestHowMuch:
    def test_few_shapes_however_many_changes(self, vcd):
        count = 30_000
        wave = Wave(vcd("wire 1 a bit\nwire 16 b bus\nwire 16 c level", "|".join(
            f"#{n}|{n % 2}a|b{n * 7 & 0xFFFF:b} b|b{n:b} c" for n in range(count))))
        svg = draw(wave, ["bit", "bus", "level"], analog=["level"])
        assert len(svg) < 60_000
        assert len(elements(svg, "busy")) == 2
        curve = points(elements(svg, "curve")[0])
        assert len(curve) > 500 and curve[0][1] > curve[len(curve) // 2][1] > curve[-1][1]

    @pytest.mark.parametrize("seed", range(5))
    def test_segments_are_the_whole_line(self, seed):
        rng = np.random.default_rng(seed)
        times = np.unique(rng.integers(0, 5000, rng.integers(1, 900)))
        values = rng.integers(0, 9, len(times)).tolist()
        trace = collect([(times.tolist(), values)], len(times), kind="bits", bits=8)
        start, end = sorted(rng.integers(0, 5000, 2).tolist())
        found = segments(trace, start, end + 1, 10, 700)
        assert found[0].left == 10 and found[-1].right == 700
        assert all(one.right == two.left for one, two in zip(found, found[1:], strict=False))
        for part in found:
            if not part.busy and part.width > 0.5:
                middle = start + (part.left + part.width / 2 - 10) / 690 * (end + 1 - start)
                assert part.value == trace.at(int(middle))

    def test_too_many_signals(self, vcd, wave):
        path = vcd("\n".join(f"wire 1 a{n} a{n}" for n in range(300)), "#0|0a1")
        assert "at most 200 rows, signals and headings, not 300" in wave(
            "draw", path, "*", "-o", "a.svg")[2]
        assert "not 201" in wave("draw", path, "a7", *["more:"] * MOST_ROWS, "-o", "a.svg")[2]


class TestFiles:
    def test_the_same_bytes(self, clocked, wave, tmp_path):
        written = []
        for name in ("a.svg", "b.svg"):
            assert wave("draw", clocked, "*", "-o", tmp_path / name)[0] == 0
            written.append((tmp_path / name).read_bytes())
        assert written[0] == written[1]

    def test_light_and_dark(self, clocked):
        svg = draw(Wave(clocked), ["*"])
        light, _, dark = svg.partition("prefers-color-scheme: dark")
        for name in set(re.findall(r'class="(\w+)"', svg)):
            style = STYLES[name]
            for colours in filter(None, (style.line, style.fill)):
                assert colours[0] in light and colours[1] in dark

    def test_picture(self, clocked, wave, tmp_path):
        path = tmp_path / "a.png"
        assert wave("draw", clocked, "clk", "count", "-o", path, "--width", "400")[0] == 0
        image = Image.open(path)
        assert image.width == 800
        seen = {colour for _, colour in image.convert("RGB").getcolors(1 << 20) or []}
        for style in ("bit", "bus"):
            line = STYLES[style].line
            assert line is not None
            assert tuple(bytes.fromhex(line[0][1:])) in seen

    def test_no_time_and_one_step(self, vcd, wave, tmp_path):
        path = vcd("wire 1 a a\nreal 64 b b", "#5|1a|rnan b")
        assert wave("draw", path, "a", "b", "-o", tmp_path / "a.svg")[0] == 0
        ET.parse(tmp_path / "a.svg")

    def test_scene_knows_its_size(self, clocked):
        drawing = scene(Wave(clocked), ["clk"], width=333)
        assert drawing.width == 333 and 40 < drawing.height < 120


class TestView:
    @pytest.fixture
    def viewer(self, monkeypatch):
        """Give what would be opened."""
        opened = []
        monkeypatch.setattr(view.shutil, "which", lambda name: f"/bin/{name}")
        monkeypatch.setattr(view.subprocess, "Popen", lambda args, **_: opened.append(args))
        monkeypatch.setenv("DISPLAY", ":0")
        return opened

    def test_save_file(self, mill, wave, viewer, tmp_path):
        save = tmp_path / "mine.gtkw"
        status, out, _ = wave("view", mill, "x.count", "ready", "*motion", "--save", save)
        assert status == 2 and not save.exists() and not viewer  # no such state: nothing is done
        status, out, _ = wave("view", mill, "x.count", "ready", "*motion_*", "--save", save)
        assert status == 0 and viewer == [["/bin/gtkwave", str(save)]] and f"wrote {save}" in out
        text = save.read_text()
        assert "automatic.x.count[15:0]\n" in text and "\nbench.top.ready\n" in text
        assert str(mill) in text and "motion_state_state\n" in text

    def test_save_file_beside_the_wave(self, mill, wave, viewer):
        assert wave("view", mill)[0] == 0
        assert viewer == [["/bin/gtkwave", str(mill.with_suffix(".gtkw"))]]
        assert wave("view", mill, "--viewer", "surfer")[0] == 0
        assert viewer[1] == ["/bin/surfer", str(mill)]

    def test_none_installed_or_no_screen(self, clocked, wave, viewer, monkeypatch):
        monkeypatch.delenv("DISPLAY")
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        monkeypatch.setattr(view.sys, "platform", "linux")
        assert "no screen" in wave("view", clocked)[2]
        monkeypatch.setattr(view.shutil, "which", lambda name: None)
        assert "neither GTKWave nor Surfer" in wave("view", clocked)[2]
        assert not viewer
        assert wave("view", clocked, "count", "--save", "a.txt")[0] == 2


class TestDocumentation:
    def test_page_has_them_all(self, capsys, monkeypatch):
        """That each is as the gateware is, the test of its bench sees."""
        monkeypatch.setattr(diagrams, "svg", lambda diagram: (
            diagrams.DOCS / diagrams.file_of(diagram)).read_text())
        assert diagrams.main(["--check"]) == 0, capsys.readouterr().out

    def test_what_is_stale_is_told(self, tmp_path, capsys, monkeypatch):
        some = diagrams.diagrams()[:2]
        monkeypatch.setattr(diagrams, "diagrams", lambda: some)
        docs = tmp_path
        assert diagrams.main(["--docs", str(docs)]) == 0
        assert diagrams.main(["--docs", str(docs), "--check"]) == 0
        first, second = sorted((docs / "timing").iterdir())
        first.write_text(first.read_text().replace("1100", "1101"))
        second.unlink()
        (docs / "timing" / "old.svg").write_text("")
        capsys.readouterr()
        assert diagrams.main(["--docs", str(docs), "--check"]) == 1
        out = capsys.readouterr().out
        assert f"timing/{first.name} is stale" in out and f"timing/{second.name} is stale" in out
        assert "timing/old.svg belongs to no component" in out
        assert first.exists() and not second.exists()  # it only looks

    def test_there_is_one_for_every_component(self):
        wanted = {bench.name for group in ("components", "machine") for bench in groups()[group]}
        assert {diagram.bench for diagram in diagrams.diagrams()} == wanted

    def test_a_failed_bench_is_told(self, monkeypatch, capsys, tmp_path):
        from tb.bench import CheckFailed

        def fail(diagram):
            raise CheckFailed(3, "tick: 1 expected, 0 seen")

        monkeypatch.setattr(diagrams, "svg", fail)
        assert diagrams.main(["--docs", str(tmp_path)]) == 1
        assert "clock 3" in capsys.readouterr().out and not list(tmp_path.iterdir())
        assert diagrams.main(["--docs", str(tmp_path / "none")]) == 2
