# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false

"""The engine that runs VHDL: it keeps the promises of `Engine`, and what is unknown is an error."""

import re
from pathlib import Path

import numpy as np
import pytest
from amaranth import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tb import boards
from tb.design import Design, Entity
from tb.engines import AmaranthEngine, EngineError, UnknownLevelError
from tb.engines.ghdl import GHDLEngine
from tests.vcd import read_changes

ghdl = pytest.mark.skipif(GHDLEngine.missing() is not None, reason=GHDLEngine.missing() or "")
pytestmark = pytest.mark.ghdl

ADDER = """\
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity adder is
  generic (first : natural; forwards : boolean);
  port (clk, rst, go : in std_logic; choice : in std_logic_vector(4 downto 0);
        total : out std_logic_vector(15 downto 0); odd : out std_logic;
        wide : out std_logic_vector(63 downto 0));
end entity;

architecture rtl of adder is
  signal sum  : unsigned(15 downto 0) := to_unsigned(first, 16);
  signal turn : unsigned(63 downto 0) := (others => '0');
begin
  process (clk)
  begin
    if rising_edge(clk) then
      turn <= rotate_left(turn, 3) + unsigned(not go & choice);
      if go = '1' and forwards then
        sum <= sum + unsigned(choice);
      end if;
      if rst = '1' then
        sum  <= to_unsigned(first, 16);
        turn <= (others => '0');
      end if;
    end if;
  end process;
  total <= std_logic_vector(sum);
  odd   <= go and sum(0){odd};
  wide  <= std_logic_vector(turn);
end architecture;
"""


class Adder(wiring.Component):
    """What the VHDL says, in Amaranth."""

    go: In(1)
    select: In(5)
    total: Out(16, init=3)
    odd: Out(1)
    wide: Out(64)

    def elaborate(self, platform) -> Module:
        m = Module()
        m.d.comb += self.odd.eq(self.go & self.total[0])
        m.d.sync += self.wide.eq(self.wide.rotate_left(3) + Cat(self.select, ~self.go))
        with m.If(self.go):
            m.d.sync += self.total.eq(self.total + self.select)
        return m


@pytest.fixture
def adder(tmp_path):
    """Make the adder, with something more to `odd` if it is given."""

    def make(odd: str = "", **generics) -> Design:
        path = tmp_path / "adder.vhd"
        path.write_text(ADDER.replace("{odd}", odd))
        design = boards.component("adder", Adder())
        vhdl = Entity("adder", (path,), {"first": 3, "forwards": True, **generics},
                      {"select": "choice"})
        return Design("adder", design.top, design.clk, design.inputs, design.outputs, vhdl)

    return make


def stimulus(rows: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    return {"rst": rng.random(rows) < 0.02, "go": rng.random(rows) < 0.5,
            "select": rng.integers(0, 32, rows)}


@ghdl
class TestEngine:
    def test_set_and_get_settle_at_once(self, adder):
        with GHDLEngine(adder()) as engine:
            assert engine.clock == 0
            assert engine.get("odd", "total") == (0, 3)
            engine.set(go=1)
            assert engine.get("odd") == 1
            assert engine.get() == ()
            assert engine.clock == 0

    def test_run_gives_every_change(self, adder):
        with GHDLEngine(adder()) as engine:
            engine.set(go=1, select=10)
            changes = engine.run(3, ["total", "odd"])
            assert changes.clock.tolist() == [0, 1, 2, 3]
            assert changes["total"].tolist() == [3, 13, 23, 33]
            engine.set(go=0)
            assert engine.run(50, ["total", "odd"])["odd"].tolist() == [0]
            assert len(engine.run(50)) == 0
            engine.set(rst=1)
            engine.run(1)
            assert engine.get("total") == 3
            assert engine.clock == 104

    def test_until(self, adder):
        with GHDLEngine(adder()) as engine:
            engine.set(go=1, select=5)
            changes = engine.run(1000, ["total"], until={"total": 18, "wide": 77})
            assert (engine.clock, changes["total"].tolist()) == (3, [3, 8, 13, 18])
            engine.run(10, until={"total": 1})
            assert engine.clock == 13

    def test_once(self, adder):
        with GHDLEngine(adder()) as engine:
            engine.run(4, ["total"])
            engine.set(go=1, select=5)
            changes = engine.run(1000, ["total"], once=True)
            assert (engine.clock, changes["total"].tolist()) == (5, [8])
            engine.set(go=0)
            assert len(engine.run(10, ["total"], once=True)) == 0
            assert engine.clock == 15

    def test_play_and_run_agree_with_amaranth(self, adder):
        design, seen = adder(), []
        played, watch = stimulus(900), list(design.outputs)
        for kind in (AmaranthEngine, GHDLEngine):
            with kind(design) as engine:
                rows = engine.apply(played, watch)
                changes = engine.run(100, watch)
                seen.append(({n: v.tolist() for n, v in rows.items()}, changes.clock.tolist(),
                             {n: v.tolist() for n, v in changes.values.items()}))
        assert seen[0] == seen[1]
        assert max(seen[0][0]["wide"]) > 1 << 62
        with GHDLEngine(design) as engine:
            for n in range(60):
                engine.set(**{name: int(values[n]) for name, values in played.items()})
                assert engine.get(*watch) == tuple(seen[0][0][name][n] for name in watch)
                engine.run(1)

    def test_generics(self, adder):
        with GHDLEngine(adder(first=8, forwards=False)) as engine:
            seen = engine.apply({"go": [1, 1], "select": [4, 4]}, ["total"])
            assert seen["total"].tolist() == [8, 8]

    def test_waveform(self, adder, tmp_path):
        path = tmp_path / "a wave.vcd"
        with GHDLEngine(adder(), vcd=path) as engine:
            engine.set(go=1, select=3)
            engine.run(2)
            engine.set(select=1)
        assert read_changes(path)["total"] == [(0, "11"), (10, "110"), (30, "1001")]

    def test_waveform_that_cannot_be_written(self, adder, tmp_path):
        with pytest.raises(EngineError, match=r"^Waveform .* cannot be written$"):
            GHDLEngine(adder(), vcd=tmp_path / "nowhere" / "it.vcd")

    def test_dies(self, adder):
        with GHDLEngine(adder()) as engine:
            assert engine._process is not None
            engine._process.kill()
            with pytest.raises(EngineError, match="ghdl has ended"):
                engine.run(5)


@ghdl
class TestUnknown:
    @pytest.mark.parametrize("level", ["X", "U", "Z", "W", "-"])
    def test_is_an_error_wherever_it_is_seen(self, adder, level):
        message = "^Output odd of adder is not known at clock {}: hex x$"
        odd = f" when choice /= \"00111\" else '{level}'"
        with GHDLEngine(adder(odd)) as engine:
            engine.set(select=7)
            with pytest.raises(UnknownLevelError, match=message.format(0)):
                engine.get("total")  # asked for or not
        with GHDLEngine(adder(odd)) as engine:
            engine.run(4)
            with pytest.raises(UnknownLevelError, match=message.format(6)) as caught:
                engine.apply({"select": [1, 2, 7, 1], "go": [1, 1, 1, 1]}, ["total"])
            assert caught.value.before["total"].tolist() == [3, 4]
        with GHDLEngine(adder(odd)) as engine:
            engine.set(select=7)
            with pytest.raises(UnknownLevelError, match=message.format(1)):
                engine.run(5)

    def test_does_not_hide_in_a_comparison(self, adder):
        """A comparison with an X is false in VHDL: what comes of it looks known."""
        odd = """;
  process (clk)
    variable lost : unsigned(3 downto 0) := (others => 'X');
  begin
    if rising_edge(clk) then
      assert lost /= 3 or choice = "00000" severity note;
    end if;
  end process"""
        with GHDLEngine(adder(odd)) as engine, pytest.raises(EngineError, match="metavalue"):
            engine.run(5)


class TestCannotRun:
    @ghdl
    def test_design_without_vhdl(self):
        clk, a, b = Signal(), Signal(), Signal()
        m = Module()
        m.d.comb += b.eq(a)
        with pytest.raises(EngineError, match="^GHDL runs VHDL, and wire has no VHDL reference"):
            GHDLEngine(Design("wire", m, clk, {"a": a}, {"b": b}))

    @ghdl
    def test_vhdl_with_an_error(self, adder):
        with pytest.raises(EngineError, match="ghdl failed: .*nothing"):
            GHDLEngine(adder(" and nothing"))

    @ghdl
    def test_port_of_another_width(self, adder, tmp_path):
        design = adder()
        path = tmp_path / "adder.vhd"
        path.write_text(path.read_text().replace("total : out std_logic_vector(15",
                                                 "total : out std_logic_vector(14"))
        with pytest.raises(EngineError, match=r"^ghdl failed: bench.vhd:\d+:\d+: actual constr"):
            GHDLEngine(design)

    def test_without_ghdl(self, adder, monkeypatch, tmp_path):
        monkeypatch.setenv("PATH", str(tmp_path))
        assert GHDLEngine.missing() == "GHDL is needed: install Debian's package ghdl"
        with pytest.raises(EngineError, match="install Debian's package ghdl"):
            GHDLEngine(adder())

    @ghdl
    def test_version(self):
        assert re.match(r"GHDL \d", GHDLEngine.version())


def test_bench_has_no_word_left_in_braces(adder):
    """The engine fills all of the template, for a design without inputs or outputs too."""
    from tb.engines import ghdl as module

    for design in (adder(), Design("empty", Module(), Signal(), {}, {})):
        text = module._bench(design, Entity("it", (Path("it.vhd"),)))
        assert not re.search(r"\{[A-Z]+\}", text)
