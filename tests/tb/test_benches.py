# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false

"""The benches: they pass, they can fail, and their waveforms can be read."""

import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import pytest
from amaranth import Module, Value
from amaranth.lib import wiring

from fresa import arithmetic, drive, machines, motion, panel, protocol
from fresa.drive import FrequencyDivider
from fresa.motion import GuardedController, ManualControl, NumericalController
from fresa.panel import Monitor, SevenSegment
from tb.__main__ import main
from tb.bench import Bench, CheckFailed, Run
from tb.benches import benches, groups
from tests.vcd import read_types
from tools.diagrams import DOCS, diagrams, draw_part, file_of

BENCHES = benches()
LONG = {"block-motion", "g-code-planner", "gcode", "gcode-thesis", "positioner", "serial-orders",
        "single", "square", "vplotter"}
"""Those that take long: whole sessions on a serial line, or every clock compared with a model."""

STUCK = {
    "frequency-divider": (FrequencyDivider, "tick", 0),
    "guarded-controller": (GuardedController, "error", 0),
    "jog-axes": (NumericalController, "axis_z", 0b0110),
    "jog-combinations": (ManualControl, "direction", 0b111),
    "square": (SevenSegment, "segments", 0xC0),
    "image": (NumericalController, "axis_x", 0b0110),
}
"""For some benches a component, one of its outputs, and its level where it is stuck.

What the benches of components and machines find is measured by mutation (:mod:`tb.mutation`); those
of the board take no part in that.
"""


def stick(monkeypatch, component, output: str, value: int) -> None:
    elaborate = component.elaborate

    def stuck(self, platform):
        m = elaborate(self, platform)
        m.d.comb += Value.cast(attrgetter(output)(self)).eq(value)
        return m

    monkeypatch.setattr(component, "elaborate", stuck)


def saved(gtkw: Path) -> dict[str, list[str]]:
    """Traces of a save file by their groups."""
    groups, group = {}, []
    for line in gtkw.read_text().splitlines():
        if line.startswith("-") and len(line) > 1:
            group = groups.setdefault(line[1:], [])
        elif line[0] not in "@[*-":
            group.append(re.sub(r"^\[color\].*|^\+\{.*?\} ", "", line))
    return groups


def run(*args: str) -> int:
    try:
        return main(list(args))
    except SystemExit as stop:
        assert isinstance(stop.code, int)
        return stop.code


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=[pytest.mark.long] * (name in LONG)) for name in BENCHES])
def test_it_passes_and_its_waveform_can_be_read(name, tmp_path, monkeypatch):
    fsms = []
    monkeypatch.setattr(Module, "FSM", lambda *args, make=Module.FSM, **options: (
        fsms.append(options), make(*args, **options))[1])
    vcd = tmp_path / "wave.vcd"
    summary = BENCHES[name].run(vcd)
    assert 20 < len(summary) < 200 and "\n" not in summary
    assert sorted(path.name for path in tmp_path.iterdir()) == ["wave.gtkw", "wave.vcd"]

    types, groups = read_types(vcd), saved(vcd.with_suffix(".gtkw"))
    shown = [trace for traces in groups.values() for trace in traces]
    assert set(shown) <= set(types)
    assert len(shown) == len(set(shown))
    assert len(groups["clock and reset"]) == 2 and groups["inputs"] and groups["outputs"]

    strings = [path for path, kind in types.items()
               if kind == "string" and path.endswith("_state")]
    assert groups.get("states", []) == strings
    assert len(strings) == len(fsms)
    if strings:
        assert re.search(r"^s[A-Z][A-Z-]+(-\d)?/\d+ ", vcd.read_text(), re.MULTILINE)

    for diagram in (diagram for diagram in diagrams() if diagram.bench == name):
        assert (DOCS / file_of(diagram)).read_text() == draw_part(diagram, vcd), (
            "not as the gateware is: python -m tools.diagrams")


def test_every_component_and_machine_has_a_bench():
    words = r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])"
    modules = [importlib.import_module(f"{room.__name__}.{found.name}")
               for room in (arithmetic, drive, motion, protocol, panel, machines)
               for found in pkgutil.iter_modules(room.__path__)]
    names = {re.sub(words, "-", name).lower() for module in modules for name in module.__all__
             if inspect.isclass(part := getattr(module, name))
             and issubclass(part, wiring.Component)}
    found = groups()
    assert list(found) == ["components", "machine", "board"]
    # The mill's station is what the benches of its board run.
    # A machine is named by its folder, and one of its dialects has a bench of its own.
    folders = {"g-code": "gcode", "v-plotter": "vplotter"}
    assert {folders.get(name, name) for name in names - {"mill-station"}} == {
        bench.name for group in ("components", "machine") for bench in found[group]
    } - {"gcode-thesis"}


@pytest.mark.parametrize("name", STUCK)
def test_a_stuck_output_is_found(name, monkeypatch, tmp_path, capsys):
    stick(monkeypatch, *STUCK[name])
    vcd = tmp_path / "wave.vcd"
    assert run(name, "--vcd", str(vcd)) == 1
    out, err = capsys.readouterr()
    message = " ".join(out.partition("wrote")[0].split())
    assert not err and len(message) < 300
    failed = re.fullmatch(rf"{name}: FAILED at clock (\d+) \((\d+) ns\): .+: .+ expected, .+ seen",
                          message)
    assert failed
    # The waveform is there, and the marker stands where it went wrong.
    assert "$enddefinitions" in vcd.read_text()
    marker = int(re.findall(r"^\*\S+ (-?\d+) ", vcd.with_suffix(".gtkw").read_text(),
                            re.MULTILINE)[0])
    assert marker == int(failed[2]) * 1_000_000 == max(0, int(failed[1]) * 20 - 10) * 1_000_000


def test_leds_that_show_nothing_are_found(monkeypatch):
    stick(monkeypatch, Monitor, "leds", 0)
    for name in ("jog-axes", "jog-combinations"):
        with pytest.raises(CheckFailed, match="LD3 to LD0: .... expected, 0000 seen"):
            BENCHES[name].run()


@pytest.mark.parametrize(("where", "value", "names"), [
    ("fresa.drive.coil.valid_period", lambda value: 1, ["coil-driver"]),  # refuses nothing
    ("fresa.drive.coil.FULL_STEP", (0b1100,) * 4, ["coil-driver", "axis-drivers"]),
    ("fresa.drive.phase.valid_period", lambda value: 1, ["phase-driver"]),
    ("fresa.drive.step_dir.in_range", lambda *given: given[1] + 1, ["step-dir-driver"]),
    ("fresa.drive.rate.in_range", lambda *given: given[1] + 1, ["rate-generator"]),
    ("fresa.motion.position.in_range", lambda *given: given[1] - 1, ["move-to"]),
    ("fresa.motion.limits.in_range", lambda *given: given[1] if given[0] == "axes" else 12,
     ["limits"]),
    ("fresa.motion.backlash.in_range", lambda *given: 1, ["backlash"]),
    ("fresa.motion.sequencer.valid_z_travel", lambda value: value + 1, ["motion-sequencer"]),
    ("fresa.motion.square.in_range", lambda *given: given[1] + 1, ["square-generator", "square"]),
    ("fresa.panel.debounce.in_range", lambda *given: 2, ["debouncer"]),
    ("fresa.panel.display.HEX_SEGMENTS", (0x3F,) * 16, ["seven-segment", "monitor", "square"]),
])
def test_a_wrong_constant_is_found(monkeypatch, where, value, names):
    """A parameter that is in no netlist, so that no mutant changes it."""
    monkeypatch.setattr(where, value)
    for name in names:
        with pytest.raises(CheckFailed):
            BENCHES[name].run()


def test_a_bench_that_never_ends_is_stopped():
    async def test(ctx):
        while True:
            await ctx.tick()

    with pytest.raises(CheckFailed, match=r"^clock 51 \(1010 ns\): .* still waiting seen"):
        Run().simulate(FrequencyDivider(period=1), test, deadline=50)


def test_a_failed_check_tells_both_values():
    run_ = Run()
    with pytest.raises(CheckFailed, match=r"clock 0 \(0 ns\): coils: 0011 expected, 1001 seen"):
        run_.expect("coils", 9, 3, bits=4)
    with pytest.raises(CheckFailed, match="steps, number 2: 5 expected, 4 seen"):
        run_.expect("steps", [1, 4, 9], [1, 5, 7])
    with pytest.raises(CheckFailed, match="steps, number 2: nothing expected, 4 seen"):
        run_.expect("steps", [1, 4], [1])
    run_.expect("steps", [1], [1])


def test_a_mistake_in_a_bench_leaves_what_was_there(tmp_path):
    def broken(run: Run) -> str:
        raise RuntimeError("mine")

    vcd = tmp_path / "wave.vcd"
    vcd.write_text("old")
    with pytest.raises(RuntimeError, match="mine"):
        Bench("broken", "", broken).run(vcd)
    assert vcd.read_text() == "old"
    assert list(tmp_path.iterdir()) == [vcd]


def test_the_command_lists(capsys):
    assert run() == 0
    out = capsys.readouterr().out.splitlines()
    assert max(map(len, out)) <= 100
    assert [line.split()[0] for line in out if line.startswith("  ")] == list(BENCHES)


def test_the_command_runs_one(tmp_path, capsys):
    assert run("coil-driver") == 0
    assert capsys.readouterr().out.startswith("coil-driver: 8 steps down the table")
    vcd = tmp_path / "odd name.vcd"
    for _ in range(2):
        assert run("coil-driver", "--vcd", str(vcd)) == 0
    assert f"wrote {vcd} and {vcd.with_suffix('.gtkw')}" in capsys.readouterr().out
    assert f'[dumpfile] "{vcd}"' in vcd.with_suffix(".gtkw").read_text()


def test_the_command_runs_all(monkeypatch, capsys):
    some = {name: BENCHES[name] for name in ("coil-driver", "monitor")}
    monkeypatch.setattr("tb.__main__.benches", lambda: some)
    assert run("all") == 0
    assert capsys.readouterr().out.endswith("\n2 of 2 benches passed\n")
    stick(monkeypatch, Monitor, "leds", 0)
    assert run("all") == 1
    assert capsys.readouterr().out.endswith("\n1 of 2 benches passed; failed: monitor\n")


@pytest.mark.parametrize(("args", "message"), [
    (["coil"], "no bench is named 'coil'; did you mean coil-driver?"),
    (["jog"], "no bench is named 'jog'; did you mean jog-axes or jog-combinations?"),
    (["squaer"], "no bench is named 'squaer'; did you mean square"),
    (["zzz"], "no bench is named 'zzz'; python -m tb lists them"),
    ([""], "no bench is named ''; python -m tb lists them"),
    (["all", "--vcd", "x.vcd"], "--vcd goes with one bench"),
    (["--vcd", "x.vcd"], "--vcd goes with one bench"),
    (["coil-driver", "--vcd"], "argument --vcd: expected one argument"),
    (["coil-driver", "monitor"], "unrecognized arguments: monitor"),
    (["coil-driver", "--vcd", "file/x.vcd"], "cannot write file/x.vcd: Not a directory"),
    (["coil-driver", "--vcd", "none/x.vcd"], "cannot write none/x.vcd: No such file or directory"),
    (["coil-driver", "--vcd", "folder"], "cannot write folder: it is not a file"),
    (["coil-driver", "--vcd", os.devnull], f"cannot write {os.devnull}: it is not a file"),
    (["coil-driver", "--vcd", "x.gtkw"], "cannot write x.gtkw: the save file takes this name"),
])
def test_what_cannot_be_done_is_an_error_of_one_line(args, message, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    Path("folder").mkdir()
    assert run(*args) == 2
    out, err = capsys.readouterr()
    assert not out and err.startswith(f"error: {message}") and err.count("\n") == 1
    assert sorted(os.listdir()) == ["file", "folder"] and Path("file").read_text() == "mine"


def test_help_teaches():
    root = Path(__file__).parents[2]
    shown = subprocess.run([sys.executable, "-m", "tb", "--help"], cwd=root, text=True,
                           capture_output=True, check=True).stdout
    assert "python -m tb motion-sequencer --vcd motion.vcd" in shown and "exit status" in shown
