# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false

"""The guard: what is upset shows, what is not never does, and synthesis leaves it there."""

import json
import re
import subprocess

from amaranth import ClockDomain, Fragment, Module, Signal
from amaranth.back import rtlil
from amaranth.sim import Simulator

from fresa.drive import FULL_STEP
from fresa.machines import Mill
from fresa.machines.mill import MillTiming
from fresa.motion import GuardedController
from fresa_boards.verilog import from_rtlil
from tb.yosys import YOSYS

TIMING = MillTiming(period=4, scan_bits=3)
TRAVEL = 6


def registers(fragment: Fragment, path: str = "") -> dict[str, Signal]:
    found = {}
    for domain, statements in fragment.statements.items():
        if domain != "comb":
            found.update((path + signal.name, signal) for signal in statements._lhs_signals())
    for inside, name, _ in fragment.subfragments:
        found.update(registers(inside, f"{path}{name}."))
    return found


class Bench:
    """A guarded controller whose registers can be upset, and its motors."""

    def __init__(self) -> None:
        self.dut = GuardedController(period=3, z_travel=2)
        m = Module()
        m.domains.sync = domain = ClockDomain()
        self.rst = domain.rst
        m.submodules.dut = fragment = Fragment.get(self.dut, None)
        self.registers = registers(fragment)
        self.sim = Simulator(m)
        self.sim.add_clock(1e-6)
        self.phases, self.places = [0, 0, 0], [0, 0, 0]
        self.moved, self.errors = False, 0

    def run(self, testbench) -> None:
        self.sim.add_testbench(testbench)
        self.sim.run()

    def look(self, ctx) -> None:
        """See what there is to be seen in this clock."""
        self.moved = False
        for axis, name in enumerate("xyz"):
            phase = FULL_STEP.index(ctx.get(getattr(self.dut, f"axis_{name}")))
            turn = (phase - self.phases[axis] + 1) % 4 - 1
            self.moved |= turn != 0
            self.phases[axis] = phase
            self.places[axis] += turn
        self.errors += ctx.get(self.dut.error) and not ctx.get(self.rst)

    async def clocks(self, ctx, count: int) -> None:
        for _ in range(count):
            self.look(ctx)
            await ctx.tick()

    async def reset(self, ctx, count: int = 1) -> None:
        ctx.set(self.rst, 1)
        await self.clocks(ctx, count)
        ctx.set(self.rst, 0)

    async def order(self, ctx, x: int, y: int, clocks: int) -> None:
        ctx.set(self.dut.mode, 1)
        ctx.set(self.dut.order.x, x)
        ctx.set(self.dut.order.y, y)
        ctx.set(self.dut.start, 1)
        await self.clocks(ctx, 1)
        ctx.set(self.dut.start, 0)
        await self.clocks(ctx, clocks)

    def upset(self, ctx, name: str, bit: int = 0) -> None:
        register = self.registers[name].as_unsigned()
        ctx.set(register, ctx.get(register) ^ 1 << bit)


class TestUpsets:
    def test_every_register(self):
        """An order of 9 and 5 steps, struck under way: it arrives, or an error shows."""
        bench = Bench()
        alarms = {}

        async def testbench(ctx):
            for number, name in enumerate(bench.registers):
                await bench.reset(ctx)
                bench.errors, bench.places = 0, [0, 0, 0]
                await bench.order(ctx, 9, 5, 8 + number % 5)
                bench.upset(ctx, name)
                await bench.clocks(ctx, 70)
                arrived = bench.places == [9, 5, 0] and [
                    ctx.get(at) for at in (bench.dut.main.automatic.at_x,
                                           bench.dut.main.automatic.at_y,
                                           bench.dut.main.automatic.at_z)] == bench.places
                assert arrived or bench.errors, name
                alarms[name] = bench.errors > 0

        bench.run(testbench)
        assert len(alarms) == 2 * 30 + 5
        position = re.compile(r"black|orange|[xyz]\.count|before|fault")
        must = list(filter(position.search, alarms))
        assert len(must) == 2 * 9 + 4
        assert all(alarms[name] for name in must)
        # What changes nothing is no alarm.
        assert not alarms["main.sequencer.raising"]


def gateware(*, guard: bool) -> str:
    return rtlil.convert(Mill(timing=TIMING, z_travel=TRAVEL, guard=guard), name="mill",
                         emit_src=False)


class TestOption:
    def test_without_it_there_is_none(self):
        text = gateware(guard=False)
        assert "shadow" not in text and "keep" not in text
        assert text == rtlil.convert(Mill(timing=TIMING, z_travel=TRAVEL), name="mill",
                                     emit_src=False)

    def test_same_pins(self):
        tops = (re.search(r"^module \\mill\n.*?^end$", gateware(guard=guard), re.S | re.M)
                for guard in (False, True))
        plain, guarded = (re.findall(r"wire width \d+ (?:in|out)put .*", top[0])
                          for top in tops if top)
        assert len(plain) == 20
        assert plain == guarded


class TestSynthesis:
    @staticmethod
    def flip_flops(folder, text: str) -> int:
        (folder / "design.il").write_text(text)
        # Up to where enables are known, behind which registers are merged.
        script = ("read_rtlil design.il; synth -flatten -top mill -run begin:fine; "
                  "opt_merge -share_all; write_json design.json")
        subprocess.run([*YOSYS, "-q", "-p", script], cwd=folder, check=True)
        cells = json.loads((folder / "design.json").read_text())["modules"]["mill"]["cells"]
        return sum(len(cell["connections"]["Q"]) for cell in cells.values() if "ff" in cell["type"])

    def test_no_register_is_merged(self, tmp_path):
        plain, guarded = (self.flip_flops(tmp_path, gateware(guard=guard))
                          for guard in (False, True))
        display, comparison = TIMING.scan_bits + 2, 3 * 2 + 2
        assert guarded == 2 * (plain - display) + display + comparison

    def test_registers_are_marked_for_xst(self):
        text = from_rtlil(gateware(guard=True))
        mark = r'\(\* equivalent_register_removal = "no" \*\)\n'
        declared = r"  (?:output|reg) (?:signed )?(?:\[\d+:0\] )?(\S+)"
        found = {True: 0, False: 0}
        for name, body in re.findall(r"^module (\w+)\(.*?;(.*?)^endmodule", text, re.S | re.M):
            registers = re.findall(r"^  reg .*?(\S+) +=", body, re.M)
            marked = re.findall(rf"{mark}(?:  \(\*.*\n)*{declared}", body)
            marked = {register.rstrip(";") for register in marked}
            assert set(registers) & marked == (set(registers) if "shadow" in name else set()), name
            found["shadow" in name] += len(registers)
        assert found[False] == found[True] + 6  # three differences, fault, seen, the display's time
