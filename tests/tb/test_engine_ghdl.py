# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false

"""The engine that runs VHDL: what is unknown is an error, and so is what it cannot run."""

import re
from pathlib import Path

import pytest
from amaranth import Module, Signal

from tb.design import Design, Entity
from tb.engines import EngineError, UnknownLevelError
from tb.engines.ghdl import GHDLEngine
from tests.tb import designs


@pytest.fixture
def adder(tmp_path):
    """Make the adder, with something more to `odd` if it is given."""

    def make(odd: str = "", **generics) -> Design:
        path = tmp_path / "adder.vhd"
        path.write_text(designs.ADDER.read_text().replace("sum(0);", f"sum(0){odd};"))
        return designs.adder(path, **generics)

    return make


@pytest.mark.ghdl
def test_generics(adder):
    with GHDLEngine(adder(first=8, forwards=False)) as engine:
        seen = engine.apply({"go": [1, 1], "select": [4, 4]}, ["total"])
        assert seen["total"].tolist() == [8, 8]


@pytest.mark.ghdl
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
    @pytest.mark.ghdl
    def test_design_without_vhdl(self):
        clk, a, b = Signal(), Signal(), Signal()
        m = Module()
        m.d.comb += b.eq(a)
        with pytest.raises(EngineError, match="^GHDL runs VHDL, and wire has no VHDL reference"):
            GHDLEngine(Design("wire", m, clk, {"a": a}, {"b": b}))

    @pytest.mark.ghdl
    def test_vhdl_with_an_error(self, adder):
        with pytest.raises(EngineError, match="ghdl failed: .*nothing"):
            GHDLEngine(adder(" and nothing"))

    @pytest.mark.ghdl
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

    @pytest.mark.ghdl
    def test_version(self):
        assert re.match(r"GHDL \d", GHDLEngine.version())


def test_bench_has_no_word_left_in_braces(adder):
    """The engine fills all of the template, for a design without inputs or outputs too."""
    from tb.engines import ghdl as module

    for design in (adder(), Design("empty", Module(), Signal(), {}, {})):
        text = module._bench(design, Entity("it", (Path("it.vhd"),)))
        assert not re.search(r"\{[A-Z]+\}", text)
