# amaranth: UnusedElaboratable=no

"""The command that compares engines: that they agree, and that a bug in one of them is found."""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tb.cosim import lockstep
from tb.engines import ENGINES, AmaranthEngine, EngineError, UnknownLevelError, source
from tb.machines import machines
from tb.machines.mill.model import MillModel
from tb.registry import duts
from tb.runners import MODEL, ModelRunner, close_all, make_runners, stimuli
from tb.shrink import script, shrink
from tb.stimulus import BLOCK, cut, last_rows, random_blocks
from tb.vhdl import REFERENCES
from tools import campaign, cosim
from tools.console import UserError

MILL = duts()["mill"]
OUTPUTS = list(MILL.shared.outputs)

pytestmark = pytest.mark.usefixtures("libraries")


def run(*arguments: object) -> int:
    return cosim.main([str(argument) for argument in arguments])


def mill_model() -> MillModel:
    assert MILL.model is not None
    model = MILL.model()
    assert isinstance(model, MillModel)
    return model


class Late(AmaranthEngine):
    """Shows `count` a clock late whenever the X axis is counted."""

    before = 0

    def _play(self, stimulus, rows, outputs):
        seen = super()._play(stimulus, rows, outputs)
        place = list(outputs).index("count")
        chosen = np.asarray(stimulus["counter_select"]) == 1
        late = np.r_[np.uint64(self.before), seen[place][:-1]]
        self.before = seen[place][-1]
        seen[place] = np.where(chosen, late, seen[place])
        return seen


class Fake:
    """A runner of one output that counts clocks, and is wrong from a clock on where `go` is 1."""

    def __init__(self, wrong_from: int = 1 << 60, unknown: int | None = None) -> None:
        self.clock, self.wrong_from, self.unknown = 0, wrong_from, unknown

    def apply(self, stimulus, outputs, /):
        clocks = self.clock + np.arange(len(stimulus["go"]))
        self.clock += len(clocks)
        if self.unknown is not None and self.unknown in clocks:
            error = UnknownLevelError("fake", "n", self.unknown, "X")
            known = clocks[clocks < self.unknown]
            error.before = {"n": known + (known >= self.wrong_from)}
            raise error
        return {"n": clocks + ((clocks >= self.wrong_from) & (stimulus["go"] == 1))}

    def close(self) -> None:
        pass


def played(runners, rows: int = 90, block: int = 20, **kwargs):
    stimulus = {"go": np.ones(rows, np.uint8), "at": np.arange(rows) // 7}
    blocks = (cut(stimulus, start, start + block) for start in range(0, rows, block))
    return lockstep(runners, blocks, ["n"], **kwargs)


class TestStimulus:
    def test_is_the_same_for_a_seed_and_no_other(self):
        first, again, other = (MILL.random(3, block, BLOCK) for block in (5, 5, 6))
        assert all((first[name] == again[name]).all() for name in first)
        assert any((first[name] != other[name]).any() for name in first)
        widths = {name: len(port) for name, port in MILL.shared.inputs.items()}
        assert set(first) == set(widths)
        for name, row in first.items():
            assert len(set(row.tolist())) > 1, name
            assert int(row.max()) < 1 << widths[name]

    def test_has_so_many_rows(self):
        blocks = random_blocks(MILL.random, 1, BLOCK + 9)
        assert sum(len(block["rst"]) for block in blocks) == BLOCK + 9
        assert sum(len(block["rst"]) for block in stimuli(MILL, 1, 777)) == 777

    def test_orders_reach_what_they_should(self):
        (block, *_) = stimuli(MILL, 1, 12_000)
        seen = ModelRunner(mill_model()).apply(block, OUTPUTS)
        assert seen["error"].any()  # refused orders
        assert (seen["ready"] & (block["mode"] == 1)).sum() > 100
        assert block["stop"].any() and block["rst"].any() and (block["mode"] == 0).any()
        assert all(len(set(seen[axis].tolist())) == 4 for axis in ("axis_x", "axis_y", "axis_z"))

    def test_last_rows(self):
        blocks = [{"a": np.arange(n, n + 10)} for n in range(0, 100, 10)]
        assert last_rows(blocks, 57, 23)["a"].tolist() == list(range(34, 57))
        assert last_rows(blocks, 7, 23)["a"].tolist() == list(range(7))


class TestLockstep:
    def test_agree(self):
        outcome = played({"a": Fake(), "b": Fake()})
        assert outcome.finding is None
        assert outcome.tallies["b"].clocks == 90
        assert outcome.checksum == played({"b": Fake()}, block=7).checksum != 0
        assert outcome.checksum != played({"b": Fake(88)}).checksum

    def test_left_behind(self):
        runners = {"a": Fake(), "b": Fake(60), "c": Fake()}
        outcome = played(runners, most={"b": 45})
        assert outcome.finding is None
        assert [tally.clocks for tally in outcome.tallies.values()] == [90, 45, 90]

    def test_first_difference(self):
        finding = played({"a": Fake(), "b": Fake(47), "c": Fake(43), "d": Fake()}).finding
        assert str(finding) == "c differs from a at clock 43: n is 0x2c, not 0x2b"

    def test_the_odd_one_is_named(self):
        finding = played({"a": Fake(43), "b": Fake(), "c": Fake()}).finding
        assert str(finding) == "a differs from b at clock 43: n is 0x2c, not 0x2b"
        finding = played({"a": Fake(), "b": Fake(43), "c": Fake(43), "d": Fake()}).finding
        assert str(finding).startswith("b (c too) differs from a at clock 43: ")

    def test_unknown(self):
        finding = played({"a": Fake(), "b": Fake(unknown=43)}).finding
        assert str(finding) == "b differs from a at clock 43: n is X, not 0x2b"
        finding = played({"a": Fake(unknown=43), "b": Fake()}).finding
        assert str(finding) == "a differs from b at clock 43: n is X, not 0x2b"
        finding = played({"a": Fake(), "b": Fake(42, unknown=43)}).finding  # wrong before
        assert str(finding) == "b differs from a at clock 42: n is 0x2b, not 0x2a"
        finding = played({"a": Fake(unknown=43), "b": Fake(unknown=44)}).finding
        assert finding is not None and finding.difference.clock == 43

    def test_the_mill_and_its_model(self):
        runners = make_runners(MILL, [MODEL, "amaranth"])
        outcome = lockstep(runners, stimuli(MILL, 5, 3000), OUTPUTS)
        close_all(runners)
        assert outcome.finding is None


class TestShrink:
    def test_only_what_is_needed_is_left(self):
        rng = np.random.default_rng(1)
        stimulus = {name: rng.integers(0, 4, 900) for name in ("a", "b", "c")}

        def test(tried):
            """Differ where b has been 3 somewhere, and then c is 2."""
            armed = np.maximum.accumulate(tried["b"] == 3)
            bad = np.flatnonzero(armed & (tried["c"] == 2))
            return None if not len(bad) else played({"x": Fake(), "y": Fake(int(bad[0]))}).finding

        found = test(stimulus)
        assert found is not None
        clock = found.difference.clock
        short = shrink(cut(stimulus, 0, clock + 1), test)
        assert short is not None
        assert len(short.stimulus["a"]) <= 2
        assert not short.stimulus["a"].any()
        actions = script(short.stimulus)
        assert ("b", 3) in actions[0].pins
        assert sum(action.clocks for action in actions) == len(short.stimulus["a"])

    def test_none_if_it_cannot_be_seen_again(self):
        assert shrink({"a": np.arange(9)}, lambda stimulus: None) is None


class TestCommand:
    def test_agree(self, tmp_path, capsys):
        figures = tmp_path / "it.json"
        assert run("--engines", "model,amaranth", "--cycles", 2000, "--seed", 4,
                   "--json", figures) == 0
        facts = json.loads(figures.read_text())
        assert facts["agree"] is True
        assert facts["engines"]["amaranth"]["clocks"] == 2000
        assert facts["engines"]["amaranth"]["version"].startswith("amaranth 0.5")
        printed = capsys.readouterr().out
        assert f"checksum {facts['checksum']}" in printed
        assert re.search(r"^amaranth +2000 clocks +\d+ clocks/s$", printed, re.M)

    @pytest.mark.icarus
    @pytest.mark.verilator
    @pytest.mark.compiler
    @pytest.mark.long
    def test_every_engine_that_runs_here(self, capsys, monkeypatch):
        monkeypatch.delitem(ENGINES, "netlist")  # takes long to compile
        assert run("--cycles", 2500) == 0
        printed = capsys.readouterr().out
        for name, engine in ENGINES.items():
            assert re.search(rf"^left out +{name}: " if engine.missing() else
                             rf"^{name} +2500 clocks", printed, re.M), name

    def test_component(self, capsys):
        """A component has no model, and is cosimulated like the mill."""
        assert run("--machine", "coil", "--engines", "amaranth,amaranth", "--cycles", 9) == 2
        assert run("--machine", "coil", "--engines", "model,amaranth") == 2
        assert "no engine is named 'model'; there are cxxrtl, " in capsys.readouterr().err
        outputs = list(duts()["coil"].shared.outputs)
        first, again = (make_runners(duts()["coil"], ["amaranth"])["amaranth"] for _ in range(2))
        outcome = lockstep({"a": first, "b": again}, stimuli(duts()["coil"], 1, 900), outputs)
        assert outcome.finding is None and outcome.tallies["b"].clocks == 900

    @pytest.mark.parametrize("machine", [
        name for machine in machines().values() if machine.model and not machine.vhdl
        for name in machine.builds])
    def test_another_machine(self, machine, capsys):
        """It has a model of its own, and no VHDL."""
        outputs = len(duts()[machine].shared.outputs)
        assert run("--machine", machine, "--engines", "model,amaranth", "--cycles", 4000) == 0
        assert f"agree      {outputs} outputs" in capsys.readouterr().out
        assert run("--machine", machine, "--engines", "model,ghdl") == 2
        assert (f"ghdl cannot run {machine}: it has no description in VHDL"
                in capsys.readouterr().err)

    @pytest.mark.ghdl
    @pytest.mark.parametrize("machine", ["mill", "sequencer"])
    def test_vhdl(self, machine, capsys):
        assert run("--machine", machine, "--engines", "amaranth,ghdl", "--cycles", 2500) == 0
        assert re.search(r"^ghdl +2500 clocks", capsys.readouterr().out, re.M)

    @pytest.mark.ghdl
    def test_mistake_that_the_vhdl_has_not(self, tmp_path, monkeypatch, capsys):
        """It is found, shrunk and drawn like any other."""
        mistake, design = REFERENCES["coil"].mistake, duts()["coil"].design
        machine = dataclasses.replace(duts()["coil"], design=lambda: mistake.planted(design()))
        monkeypatch.setitem(duts(), "coil", machine)
        assert run("--machine", "coil", "--engines", "amaranth,ghdl", "--cycles", 2000, "--vcd",
                   tmp_path / "bug", "--shrink-seconds", 10) == 1
        printed = capsys.readouterr().out
        assert "ghdl differs from amaranth at clock " in printed
        assert re.search(r"shortest   ghdl differs from amaranth at clock \d: coils is ", printed)
        for name in ("amaranth", "ghdl"):
            assert "coils" in (tmp_path / f"bug-{name}.vcd").read_text()

    def test_planted_bug(self, tmp_path, capsys, monkeypatch):
        monkeypatch.setitem(ENGINES, "amaranth", Late)
        prefix, figures = tmp_path / "bug", tmp_path / "bug.json"
        assert run("--engines", "model,amaranth", "--cycles", 3000, "--vcd", prefix, "--json",
                   figures, "--shrink-seconds", 10) == 1
        facts = json.loads(figures.read_text())
        first, short = facts["difference"], facts["shrunk"]
        assert facts["agree"] is False
        assert (first["engine"], first["reference"]) == ("amaranth", "model")
        assert list(first["outputs"]) == list(short["outputs"]) == ["count"]
        block = last_rows(stimuli(MILL, 1, 3000), 3000, 3000)
        count = ModelRunner(mill_model()).apply(block, OUTPUTS)["count"]
        late = (block["counter_select"][1:] == 1) & (count[1:] != count[:-1])
        assert first["clock"] == 1 + late.argmax()
        assert short["clock"] < 20
        printed = capsys.readouterr().out
        assert f"amaranth differs from model at clock {first['clock']}: count is " in printed
        for name in ("model", "amaranth"):
            assert "count" in Path(f"{prefix}-{name}.vcd").read_text()

    @pytest.mark.icarus
    def test_constant_changed_in_the_verilog(self, tmp_path, monkeypatch, capsys):
        """The tool travels 6 steps, not 5: it must differ just where a model that does so does."""
        mill = machines()["mill"]
        wrong = mill.design(**{**mill.short, "z_travel": 6})
        bug = type("Bug", (ENGINES["icarus"],), {
            "_sources": classmethod(lambda cls, design: {"design.v": source.verilog(wrong)})})
        monkeypatch.setitem(ENGINES, "icarus", bug)
        models = {name: ModelRunner(MillModel(period=3, scan_bits=4, jog_period=2, z_travel=n))
                  for name, n in (("model", 5), ("icarus", 6))}
        expected = lockstep(models, stimuli(MILL, 1, 4000), OUTPUTS).finding
        prefix, figures = tmp_path / "bug", tmp_path / "bug.json"
        assert run("--engines", "model,icarus", "--cycles", 4000, "--vcd", prefix, "--json",
                   figures, "--shrink-seconds", 15) == 1
        assert f"DIFFER     {expected}\n" in capsys.readouterr().out
        short = json.loads(figures.read_text())["shrunk"]
        # Down or up: one order, the switch in automatic mode, and the clocks of five steps.
        assert short["clock"] < 30
        assert len(short["script"]) <= 3
        pins = {name for step in short["script"] for name in step["pins"]}
        assert {"mode", "start"} < pins <= {"mode", "start", "up", "down", "counter_select"}
        assert {path.name for path in tmp_path.glob("*.vcd")} == {"bug-model.vcd", "bug-icarus.vcd"}

    def test_missing(self, monkeypatch, capsys):
        for name, engine in ENGINES.items():
            reason = "get Icarus" if name == "icarus" else None
            monkeypatch.setattr(engine, "missing", classmethod(lambda cls, reason=reason: reason))
        assert run("--engines", "all") == 2
        assert "icarus cannot run here: get Icarus" in capsys.readouterr().err
        assert run("--engines", "model,icarus") == 2

    @pytest.mark.parametrize(("arguments", "message"), [
        (["--engines", "nvc"], "no engine is named 'nvc'; there are model, cxxrtl, amaranth, "),
        (["--engines", "model"], "it takes two engines to compare"),
        (["--cycles", "0"], "must be a whole number from 1, not '0'"),
        (["--seed", "-1"], "must be a whole number from 0, not '-1'"),
        (["--machine", "lathe"], "invalid choice: 'lathe'"),
        (["--json", "nowhere/it.json"], "its folder does not exist"),
        (["--vcd", "nowhere/it"], "its folder does not exist"),
        (["--campaign", "9", "--engines", "model,amaranth"], "leave the model out"),
    ])
    def test_misuse(self, arguments, message, capsys):
        assert run(*arguments) == 2
        assert message in capsys.readouterr().err


class TestCampaign:
    def test_runs_and_resumes(self, tmp_path, capsys, monkeypatch):
        monkeypatch.setattr(campaign, "CHUNK", 64)
        monkeypatch.setattr(campaign, "run", self.here)
        state = tmp_path / "state.json"
        arguments = ["--campaign", 150, "--engines", "amaranth,other", "--state", state]
        monkeypatch.setitem(ENGINES, "other", AmaranthEngine)
        assert run(*arguments) == 0
        first = re.search(r"checksum (\w+)", capsys.readouterr().out)
        saved = json.loads(state.read_text())
        assert sorted(saved["done"]) == ["0", "1", "2"]
        del saved["done"]["1"]
        state.write_text(json.dumps(saved))
        assert run(*arguments) == 0
        printed = capsys.readouterr().out
        assert "resumed    86 of 150 clocks were done" in printed
        assert first is not None and first[0] in printed
        assert run(*arguments, "--seed", 2) == 2
        assert "is of another campaign (other seed)" in capsys.readouterr().err

    @staticmethod
    def here(made, path, jobs, advance):
        """Run chunks in this process."""
        for chunk in range(made.plan.chunks):
            if chunk not in made.done:
                total, times, finding = campaign._run_chunk(made.plan, chunk)
                assert finding is None
                made.done[chunk] = total, times
                made.save(path)
                advance(made.plan.size(chunk))

    def test_not_a_state(self, tmp_path):
        (tmp_path / "it.json").write_text("[]")
        with pytest.raises(UserError, match="is not the state of a campaign"):
            campaign.load(tmp_path / "it.json", campaign.Plan("mill", ("a", "b"), 1, 9, ""))

    @pytest.mark.verilator
    @pytest.mark.compiler
    @pytest.mark.long  # and of the record, for longer
    def test_in_processes(self, tmp_path, capsys):
        assert run("--campaign", 100_000, "--jobs", 1, "--state", tmp_path / "it.json") == 0
        assert re.search(r"^verilator +100000 clocks", capsys.readouterr().out, re.M)


def test_engine_errors_are_one_line(monkeypatch, capsys):
    def fail(*_, **__):
        raise EngineError("it is broken")

    monkeypatch.setattr(cosim, "make_runners", fail)
    assert run("--engines", "model,amaranth") == 2
    assert capsys.readouterr().err == "error: it is broken\n"
