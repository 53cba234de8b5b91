# amaranth: UnusedElaboratable=no

"""The Verilog of the mill, as users get it, under the simulators that they have."""

import dataclasses
import random
import shutil
import subprocess
from pathlib import Path

import pytest

from fresa.machines import MillStation
from fresa.machines.mill import Mill, MillTiming
from fresa.motion import CoordinateGenerator
from fresa_boards.nexys2 import NEXYS2_500
from fresa_boards.verilog import emit
from fresa_boards.wiring import prepare
from tb.machines.mill.model import MillInputs, MillModel

PERIOD, SCAN_BITS, Z_TRAVEL, CLOCKS = 2, 3, 3, 4000
BITS = {"position_x": 16, "position_y": 16, "counter_select": 2, "jog": 6,
        "axis_x": 4, "axis_y": 4, "axis_z": 4, "leds": 4, "count": 16, "segments": 8, "digits": 4}


def stimulus() -> list[MillInputs]:
    """Orders and jogs, resets and stops, without end."""
    chance = random.Random(7)
    pins, rows = MillInputs(mode=1), []
    for clock in range(CLOCKS):
        pins = dataclasses.replace(
            pins,
            rst=int(chance.random() < 0.003),
            stop=int(chance.random() < 0.001),
            start=int(clock % 5 == 0),
            up=int(chance.random() < 0.15),
            down=int(chance.random() < 0.15),
            counter_select=chance.randrange(4),
        )
        if clock % 40 == 0:
            pins.position_x, pins.position_y = chance.randrange(9), chance.randrange(9)
            pins.jog = chance.getrandbits(6)
        if clock % 500 == 450:
            pins.mode = 0
        if clock % 500 == 499:
            pins.mode = 1
        rows.append(pins)
    return rows


def expected(rows: list[MillInputs]) -> list[str]:
    model = MillModel(period=PERIOD, scan_bits=SCAN_BITS, z_travel=Z_TRAVEL)
    lines = []
    for pins in rows:
        outputs = dataclasses.asdict(model.outputs(pins))
        lines.append(" ".join(f"{value:0{BITS.get(name, 1)}b}" for name, value in outputs.items()))
        model.edge(pins)
    return lines


def bench(rows: list[MillInputs]) -> str:
    """A test bench that every Verilog understands."""
    inputs = [field.name for field in dataclasses.fields(MillInputs)]
    outputs = [name for name in ("ready", "error", "axis_x", "axis_y", "axis_z", "leds", "count",
                                 "segments", "digits")]

    def declare(kind: str, names: list[str]) -> str:
        return "".join(f"  {kind} [{BITS.get(name, 1) - 1}:0] {name};\n" for name in names)

    ports = ", ".join(f".{name}({name})" for name in ["clk", *inputs, *outputs])
    rows_text = "".join(
        f"    {{{', '.join(inputs)}}} = {{"
        + ", ".join(f"{BITS.get(name, 1)}'d{getattr(row, name)}" for name in inputs)
        + "}; show;\n" for row in rows)
    return (
        "module bench;\n  reg clk;\n" + declare("reg", inputs) + declare("wire", outputs)
        + f"  mill dut({ports});\n"
        + "  task show; begin #1 $display(\"" + " ".join(["%b"] * len(outputs)) + "\", "
        + ", ".join(outputs) + "); #1 clk = 1; #1 clk = 0; end endtask\n"
        + "  initial begin\n    clk = 0;\n" + rows_text + "  end\nendmodule\n")


@pytest.fixture(scope="module")
def verilog() -> str:
    mill = Mill(timing=MillTiming(period=PERIOD, scan_bits=SCAN_BITS), z_travel=Z_TRAVEL)
    return emit(mill, name="mill")


def tool(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


@pytest.mark.icarus
@pytest.mark.parametrize("language", ["2001", "2005", "2005-sv", "2009", "2012"])
def test_icarus_agrees_with_the_model_at_every_clock(verilog, language, tmp_path):
    """From clock 0 on, so that an X anywhere would show."""
    rows = stimulus()
    (tmp_path / "mill.v").write_text(verilog)
    (tmp_path / "bench.v").write_text(bench(rows))
    program = tmp_path / "bench"
    subprocess.run(
        [tool("iverilog"), f"-g{language}", "-o", program, tmp_path / "mill.v",
         tmp_path / "bench.v"], check=True)
    run = subprocess.run([tool("vvp"), "-n", program], check=True, capture_output=True, text=True)
    for clock, (seen, wanted) in enumerate(
            zip(run.stdout.splitlines(), expected(rows), strict=True)):
        assert seen == wanted, f"clock {clock}"


def lint(path: Path, top: str) -> str:
    run = subprocess.run(
        [tool("verilator"), "--lint-only", "-Wall", "-Wno-UNUSED", "--top-module", top, path],
        capture_output=True, text=True, check=False)
    return run.stderr


@pytest.mark.verilator
class TestVerilator:
    def test_raw_machine(self, tmp_path):
        (tmp_path / "mill.v").write_text(emit(Mill(), name="mill"))
        assert lint(tmp_path / "mill.v", "mill") == ""

    def test_board(self, tmp_path):
        picture = [[(row * column) % 3 == 0 for column in range(200)] for row in range(150)]
        source = CoordinateGenerator(picture, pixel_steps=128)
        plan = prepare(NEXYS2_500, "mill", MillStation(source=source))
        (tmp_path / "mill.v").write_bytes(plan.files["mill.v"])
        assert lint(tmp_path / "mill.v", "mill") == ""
