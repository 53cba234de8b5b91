"""The record of verification: what is run, what is kept, and that the page says what was found."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fresa_boards.nexys2 import NEXYS2_500
from tb.machines import machines
from tb.registry import components
from tools import fingerprints, record
from tools.record import BEGUN, KEPT, Part, main, parts, run
from tools.record_page import dump, page, summary

DOCS = Path(__file__).parents[2] / "docs"

EACH = """\
import json, pathlib, sys
folder, *names = sys.argv[1:]
(pathlib.Path(folder) / "figures.json").write_text(json.dumps({
    "versions": {}, "components": {name: "now" for name in names or ["coil", "divider", "rate"]}}))
"""

CHECK = """\
import json, os, pathlib, sys
folder, status = pathlib.Path(sys.argv[1]), int(os.path.expandvars(sys.argv[2]))
with open(folder / "calls", "a") as calls:
    calls.write("x")
if status < 2:
    (folder / "figures.json").write_text(json.dumps({"found": 7, "versions": {"check": "1.0"}}))
sys.exit(status)
"""


@pytest.fixture
def check(tmp_path, monkeypatch):
    """Make a command that counts how often it was called, and ends with the status it is given."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "its_check.py").write_text(CHECK)
    (tmp_path / "lib" / "its_each.py").write_text(EACH)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "lib"))
    monkeypatch.setattr(record, "ROOT", tmp_path)
    return lambda status, name="some": Part(name, f"its_check {{folder}} {status}", ("run it",))


@pytest.fixture(autouse=True)
def prints(monkeypatch):
    """Give the fingerprints, of which there are few here, to change them."""
    found = {"run it": "0123", "contract it": "4567"}
    monkeypatch.setattr(fingerprints, "names", lambda kind: [
        name for name in found if name.startswith(f"{kind} ")])
    monkeypatch.setattr(fingerprints, "take", lambda wanted: {
        name: found.get(name, "gone") for name in wanted})
    return found


def calls(work: Path, name: str = "some") -> int:
    return len((work / name / "calls").read_text())


class TestRun:
    def test_keeps_figures_and_does_not_run_again(self, check, tmp_path):
        work = tmp_path / "build"
        first = run([check(0)], work) or {}
        again = run([check(0)], work)
        assert first == again
        assert first["parts"]["some"]["facts"] == {"found": 7, "versions": {"check": "1.0"}}
        assert first["parts"]["some"]["of"] == {"run it": "0123"}
        assert calls(work) == 1

    def test_runs_again_when_what_it_is_of_has_changed(self, check, tmp_path, prints):
        work = tmp_path / "build"
        run([check(0)], work)
        before = (work / "some" / KEPT).read_text()
        prints["contract it"] = "another"
        assert run([check(0)], work) is not None
        assert (work / "some" / KEPT).read_text() == before
        prints["run it"] = "89ab"
        facts = run([check(0)], work) or {}
        assert facts["parts"]["some"]["of"] == {"run it": "89ab"}
        assert (work / "some" / KEPT).read_text() != before

    @pytest.mark.parametrize("changed", ["versions", "command"])
    def test_runs_again_when_something_has_changed(self, check, tmp_path, monkeypatch, changed):
        work = tmp_path / "build"
        run([check(0)], work)
        if changed == "versions":
            monkeypatch.setattr(record, "versions", lambda: ("Python 4",))
        before = (work / "some" / KEPT).read_text()
        part = check(0) if changed != "command" else replace(
            check(0), command="its_check {folder} 0 more")
        assert run([part], work) is not None
        assert calls(work) == 1  # of a folder that was emptied first
        assert (work / "some" / KEPT).read_text() != before

    def test_what_is_named_begins_anew(self, check, tmp_path):
        work = tmp_path / "build"
        run([check(0)], work)
        (work / "some" / "state.json").write_text("half done")
        run([check(0)], work, again=["some"])
        assert not (work / "some" / "state.json").exists()
        assert calls(work) == 1

    def test_what_was_interrupted_goes_on_and_its_seconds_too(self, check, tmp_path, monkeypatch):
        work = tmp_path / "build"
        record.versions()  # which asks engines, once: only the command is interrupted
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(record.subprocess, "run", interrupted)
            run([check(0)], work)
        (work / "some" / "state.json").write_text("half done")
        begun = json.loads((work / "some" / BEGUN).read_text())
        (work / "some" / BEGUN).write_text(json.dumps(begun | {"seconds": 1000}))
        facts = run([check(0)], work) or {}
        assert (work / "some" / "state.json").exists()
        assert facts["parts"]["some"]["seconds"] >= 1000

    def test_what_remembers_by_itself_loses_nothing_and_the_page_says_so(
            self, check, tmp_path, prints):
        work, part = tmp_path / "build", replace(check(0), remembers=True)
        facts = run([part], work) or {}
        assert not facts["parts"]["some"]["resumed"]
        prints["run it"] = "89ab"
        for _ in range(2):
            facts = run([part], work) or {}
            assert facts["parts"]["some"]["resumed"]
            assert calls(work) == 2
        facts = run([part], work, again=["some"]) or {}
        assert not facts["parts"]["some"]["resumed"]
        assert calls(work) == 1

    def test_does_not_trust_what_is_damaged(self, check, tmp_path):
        work = tmp_path / "build"
        run([check(0)], work)
        (work / "some" / KEPT).write_text("{")
        assert run([check(0)], work) is not None
        assert calls(work) == 2

    def test_a_command_that_finds_fault_leaves_no_record_but_runs_the_rest(
            self, check, tmp_path, capsys):
        work = tmp_path / "build"
        both = [check(1), check(0, "other")]
        assert run(both, work) is None
        assert "NOT in order: some" in capsys.readouterr().out
        assert calls(work, "other") == 1
        assert run(both, work) is None
        assert (calls(work), calls(work, "other")) == (1, 1)

    def test_what_found_fault_when_it_was_run_again_is_not_good_from_before(
            self, check, tmp_path, monkeypatch):
        work = tmp_path / "build"
        monkeypatch.setenv("STATUS", "0")
        part = replace(check(0), command="its_check {folder} $STATUS")
        assert run([part], work) is not None
        monkeypatch.setenv("STATUS", "1")
        assert run([part], work, again=["some"]) is None
        assert run([part], work) is None

    def test_a_command_that_fails_stops_it(self, check, tmp_path):
        with pytest.raises(record.UserError, match="could not be carried out"):
            run([check(2)], tmp_path / "build")

    def test_what_a_record_says_of_what_is_here_is_not_run_again(self, check, tmp_path, prints):
        work = tmp_path / "build"
        written = run([check(0)], work) or {}
        shutil.rmtree(work)
        assert run([check(0)], work, written=written) == written
        assert not work.exists()
        prints["run it"] = "89ab"
        again = run([check(0)], work, written=written) or {}
        assert again["parts"]["some"]["of"] == {"run it": "89ab"}
        assert calls(work) == 1

    def test_components_that_a_record_has_are_not_run_again(
            self, check, tmp_path, prints, monkeypatch):
        monkeypatch.setattr(record, "_sentences", lambda names: len(names))
        part = Part("some", "its_each {folder}", ("contract coil", "contract divider",
                                                  "contract rate"), single=True)
        prints |= dict.fromkeys(part.on, "0123")
        written = run([part], tmp_path / "build") or {}
        facts = written["parts"]["some"]["facts"]
        assert facts["components"] == {"coil": "now", "divider": "now", "rate": "now"}
        facts["components"] = dict.fromkeys(facts["components"], "before")
        prints["contract divider"] = "4567"
        shutil.rmtree(tmp_path / "build")
        again = run([part], tmp_path / "build", written=written) or {}
        assert again["parts"]["some"]["facts"] == {
            "versions": {}, "sentences": 3,
            "components": {"coil": "before", "divider": "now", "rate": "before"}}
        assert again["parts"]["some"]["command"] == written["parts"]["some"]["command"]
        whole = run([part], tmp_path / "build", written=written, again=["some"]) or {}
        assert whole["parts"]["some"]["facts"] == {
            "versions": {}, "components": {"coil": "now", "divider": "now", "rate": "now"}}

    def test_quick_is_another_command(self, check, tmp_path):
        part = replace(check(1), quick="its_check {folder} 0")
        assert run([part], tmp_path / "build") is None
        assert run([part], tmp_path / "build", quick=True) is not None


def interrupted(*args, **kwargs):
    raise KeyboardInterrupt


class TestFreshness:
    @pytest.fixture
    def folder(self, tmp_path, monkeypatch):
        monkeypatch.setattr(record, "parts", lambda: {
            "one": Part("one", "its_check {folder}", ("run it",)),
            "two": Part("two", "another", ("contract",))})
        (tmp_path / "verification.json").write_text(json.dumps({"parts": {
            "one": {"command": "python -m its_check build/record/one", "of": {"run it": "0123"}},
            "two": {"command": "python -m another", "of": {"contract it": "4567"}}}}))
        return tmp_path

    def test_is_fresh(self, folder, capsys):
        assert main(["--check", "-o", str(folder)]) == 0
        assert capsys.readouterr().out == "2 of 2 parts are of what is here\n"

    def test_names_what_is_stale(self, folder, prints, capsys):
        prints["contract it"] = "another"
        assert main(["--check", "-o", str(folder)]) == 1
        printed = capsys.readouterr().out
        assert "stale: two, of another contract it\n" in printed
        assert "1 of 2 parts are of what is here; run python -m tools.record two\n" in printed

    def test_what_is_new_makes_it_stale(self, folder, prints, capsys):
        prints["contract new"] = "1111"
        assert main(["--check", "-o", str(folder)]) == 1
        assert "stale: two, of another contract new\n" in capsys.readouterr().out

    def test_another_command_makes_it_stale(self, folder, monkeypatch, capsys):
        monkeypatch.setattr(record, "parts", lambda: {
            "two": Part("two", "another one", ("contract",))})
        assert main(["--check", "-o", str(folder)]) == 1
        assert "stale: two, of another command\n" in capsys.readouterr().out

    def test_no_record(self, tmp_path, capsys):
        assert main(["--check", "-o", str(tmp_path)]) == 2
        assert "there is no record in" in capsys.readouterr().err


def test_each_part_depends_on_something():
    assert all(part.on for part in parts().values())


def test_mutants_are_of_every_component():
    named = [part for part in parts().values() if "tools.mutate" in part.command]
    without = {name for name, machine in machines().items() if machine.recorded.unmutated}
    assert sorted(name for part in named for name in part.on) == sorted(
        f"mutants {name}" for name in components() if name not in without)


def test_how_many_mutants_of_a_machine_have_to_be_killed():
    assert " --least 95 " in parts()["mutants-gcode"].command
    assert " --least 90 " in parts()["mutants-vplotter"].command
    assert "--least" not in parts()["mutants-mill"].command


def test_mutants_are_of_the_contracts_and_the_benches_of_their_components():
    assert sorted(parts()["mutants-single"].depends()) == [
        "bench frame-interpreter", "bench single", "contract frames", "contract single"]


def test_benchmarks_are_of_the_gateware_and_of_its_models():
    both, models = ("run gcode", "model gcode"), ("model gcode",)
    for name, on in (("ends", both), ("limits", both), ("reach", both), ("load", both),
                     ("instants", models), ("planning", models), ("arcs", models),
                     ("hour", models)):
        assert parts()[f"{name}-gcode"].on == on
        assert "--json {folder}/figures.json" in parts()[f"{name}-gcode"].command


def test_a_machine_may_have_numbers_of_faults_of_its_own():
    most, fewer = machines()["gcode"].recorded.faults["flips"]
    own, other = parts()["flips-gcode"], parts()["flips-single"]
    assert f" --flips {most} " in own.command and f" --flips {fewer} " in (own.quick or "")
    assert "--flips" not in other.command and " --flips 10000 " in (other.quick or "")


class TestPage:
    def test_docs_say_what_the_figures_say(self):
        text = (DOCS / "verification.json").read_text(encoding="utf-8")
        facts = json.loads(text)
        assert set(facts["parts"]) <= set(parts())
        assert dump(facts) == text and len(text.splitlines()) < 2000
        assert page(facts) == (DOCS / "verification.md").read_text(encoding="utf-8")

    def test_mutants_are_added_up(self):
        one = {"mutants": 10, "equivalent": 2, "broken": 6, "unproved": 1, "bench": 5, "killed": 8,
               "survive": 0}
        two = {**one, "killed": 4, "survive": 4}
        none = dict.fromkeys(one, 0)
        facts = {"parts": {name: {"command": name, "seconds": 1, "resumed": False, "facts": {
            "all": counts, "survivors": [], "without": [f"{name}-bare"],
            "components": {name: {**counts, "possible": 400, "score": 50.0}}}}
            for name, counts in (("mutants", one), ("mutants-one", two),
                                 ("mutants-two", none))},
            "cores": 2, "versions": []}
        text = page(facts)
        assert "| **all** | 1 200 | 20 | 4 | 12 | 2 | 10 | 12 | 4 | 75.00 |" in text
        assert "none were made: mutants-bare, mutants-one-bare and mutants-two-bare." in text

    def test_every_figure_is_from_the_record(self):
        facts = json.loads((DOCS / "verification.json").read_text(encoding="utf-8"))
        facts["parts"]["size-mill"]["facts"]["resources"]["luts"] = 12345
        facts["parts"]["engines-mill"]["facts"]["engines"]["icarus"]["clocks"] = 7654321
        facts["parts"]["flips-mill"]["facts"]["machines"][1]["silent"] = 9876543
        text = page(facts)
        for figure in ("| 12345 |", "| 7 654 321 |", "| 9 876 543 |"):
            assert figure in text

    def test_a_part_that_was_not_run_is_said_to_be_left_out(self):
        facts = json.loads((DOCS / "verification.json").read_text(encoding="utf-8"))
        facts["parts"].pop("vhdl", None)
        facts["left_out"] = ["vhdl"]
        assert "Left out of this record: vhdl." in page(facts)

    def test_parts_that_say_something_by_themselves_are_shown_without_the_others(self):
        facts = json.loads((DOCS / "verification.json").read_text(encoding="utf-8"))
        seen = facts["parts"]["pair-mill"]["facts"]["checksum"]
        assert seen in page(facts)
        facts["parts"].pop("campaign-mill", None)
        facts["left_out"] = ["campaign-mill"]
        assert seen in page(facts)
        assert "Left out of this record: campaign-mill." in page(facts)

    @pytest.mark.parametrize("name", ["size-mill", "size-mill-guard", "size-mill-serial",
                                      "size-single", "size-positioner"])
    def test_the_sizes_of_the_record_are_those_of_the_page(self, name):
        facts = json.loads((DOCS / "verification.json").read_text(encoding="utf-8"))
        found = facts["parts"][name]["facts"]["resources"]
        row = " | ".join(str(found[what]) for what in ("luts", "flip_flops", "block_rams"))
        assert f"| {row} |" in (DOCS / "evidence.md").read_text(encoding="utf-8")

    def test_what_a_board_has_and_nothing_counts_is_no_column(self):
        facts = json.loads((DOCS / "verification.json").read_text(encoding="utf-8"))
        size = facts["parts"]["size-mill"]
        for capacity in (size["facts"]["capacity"], vars(NEXYS2_500.capacity)):
            size["facts"]["capacity"] = capacity
            assert "| design | luts | flip flops | block rams | multipliers |" in page(
                facts | {"parts": {"size-mill": size}})

    def test_every_part_has_its_place(self):
        text = page({"parts": {}, "cores": 2, "versions": [], "left_out": list(parts())})
        left_out = re.findall(r"^Left out of this record: (.*)\.$", text, re.M)
        assert sorted(parts()) == sorted(name for names in left_out for name in names.split(", "))

    def test_coverage_of_each_machine(self):
        def facts(name: str, **more) -> Any:
            percents = {"seen": 1, "all": 2, "percent": 50.0, "least": 49.5}
            return summary(name, more | {"lines": {
                "machine": f"its {name}", "clocks": 9000, "engine": "Verilator 7", "never": [9],
                "lines and branches": percents, "bits": percents}})

        names = "coverage-mill", "coverage-single"
        made = {name: {"command": name, "seconds": 1, "resumed": False, "facts": facts(name)}
                for name in names}
        states = {"command": "", "seconds": 1, "resumed": False,
                  "facts": summary("coverage-states", {"states": [
                      {"component": "coil", "kind": "state", "clock": 3}]})}
        text = page({"parts": {"coverage-states": states, **made}, "cores": 2, "versions": []})
        assert "| coil | 1 of 1 | - | 3 |" in text
        for name in names:
            assert f"| its {name} | 9 000 | bits | 1 | 2 | 50.00 | 49.5 |" in text
            assert "never" not in made[name]["facts"]["lines"]

    def test_instants_and_ends_of_a_machine(self):
        steps = {"programs": 8, "blocks": 34, "steps": 17_137, "fastest": 121_065,
                 "clocks": [-0.6, 3.2, 27.6, 75.6, 3122.3], "late": 0,
                 "share": [0, 0, 0, 0.0164, 1], "tick_clocks": [-0.9, 0, 1, 1, 1.07],
                 "begins": [-1.5, 1.27]}
        ticks = {"programs": 3, "seconds": 5.6, "least": -0.72, "most": 0.54, "p50": 0.7,
                 "p99": 0.71, "late": 0}
        ends = {"blocks": 10**6, "arcs": 5, "lines": 7000, "steps": 9, "off": 0, "most": 0}
        made = {name: {"command": name, "seconds": 1, "resumed": False, "facts": summary(
            name, facts)} for name, facts in (
            ("instants-it", {"steps": {"lines": steps}, "ticks": {"30": ticks}}),
            ("ends-it", {"model": ends, "gateware": {**ends, "places": 88}}))}
        text = page({"parts": made, "cores": 2, "versions": []})
        assert ("| lines | 8 | 34 | 17 137 | 121 065 | -0.6 | +3.2 | +27.6 | +75.6 | +3122.3 | 1.6 "
                "| -0.90 to +1.07 | -1.50 to +1.27 | 0 |") in text
        assert "| 30 | 3 | 5.6 | -0.72 | +0.54 | 0.7 | 0.71 | 0 |" in text
        assert "| model | 1 000 000 | 5 | 7 000 | 9 | 7 000 | 0 | 0 |" in text
        assert "| gateware | 1 000 000 | 5 | 7 000 | 9 | 88 | 0 | 0 |" in text

    def test_a_machine_under_load(self):
        facts = {"line used": {"name": "line used", "unit": "%", "measured": 99.5, "least": 99.0,
                               "most": None, "right": True},
                 "steps off": {"name": "steps off", "unit": "steps", "measured": 1, "least": None,
                               "most": 0, "right": False},
                 "lines": {"name": "lines", "unit": "", "measured": 12_345, "least": None,
                           "most": None, "right": True}}
        text = page({"parts": {"load-it": {"command": "it", "seconds": 1, "resumed": False,
                                           "facts": summary("load-it", facts)}},
                     "cores": 2, "versions": []})
        assert "| line used | 99.5 | % | at least 99 | yes |" in text
        assert "| steps off | 1 | steps | at most 0 | **no** |" in text
        assert "| lines | 12 345 |  | - | yes |" in text

    def test_what_a_machine_reaches(self):
        found = {
            "limits-it": {"limits": {
                "speed": {"measured": 1234, "unresolved": 0, "error": 0.005, "highest": 1.0004,
                          "least": 0.9954},
                "corners": {"measured": 9, "unresolved": 2, "error": 0.01, "highest": 1.2,
                            "least": 1.19},
                "ends": {"measured": 0, "unresolved": 3, "error": 0, "highest": 0, "least": 0}}},
            "reach-it": {"axis": {"name": "axis", "unit": "steps/s", "measured": 3_000_001,
                                  "least": 3_000_000, "most": None, "right": True}},
            "planning-it": {"pass_clocks": {"64": 518}, "runs": [
                {"depth": 64, "lines": 5000, "speed": 3400.7, "by_depth": 3394.1,
                 "by_lines": 15000.0, "waiting": 63.0, "brakes": 0, "empty": 1}]},
            "arcs-it": {"equal": {
                "arcs": 101, "turns": 5000, "steps": 400, "corrective": 3, "beyond": 0,
                "ripple": [0.0001] * 101,
                **{name: [each / 128 for each in range(101)] for name in ("grid", "sync", "end")}}}}
        made = {name: {"command": name, "seconds": 1, "resumed": False,
                       "facts": summary(name, facts)} for name, facts in found.items()}
        assert made["arcs-it"]["facts"]["equal"]["grid"] == [0.3906, 0.7734, 0.7812]
        text = page({"parts": made, "cores": 2, "versions": []})
        assert "| speed | 1 234 | 0 | 0.005 | 1.000 | 0.995 | yes |" in text
        assert "| corners | 9 | 2 | 0.010 | 1.200 | 1.190 | **no** |" in text
        assert "| ends | 0 | 3 | 0.000 | 0.000 | 0.000 | **no** |" in text
        assert "| axis | 3 000 001 | steps/s | at least 3 000 000 | yes |" in text
        assert "| 64 | 518 | 5 000 | 3 401 | 3 394 | 15 000 | 63.0 | 0 | 1 |" in text
        assert ("| equal | 101 | 5 000 | 400 | 0.773 | 0.781 | 0.773 | 0.781 | 0.773 | 0.781 | "
                "0.01 | 3 | 0 |") in text

    def test_each_machine_that_is_struck(self):
        def facts(name: str, **more) -> Any:
            return summary(name, {"machines": [more | {
                "resets": 500, "clocks": 9000, "steps": 70, "wrong": ["much"] * 20,
                "flip_flops": 263, "flips": 1000, "harmless": 600, "visible": 300, "stuck": 20,
                "silent": 80, "silent_rate": 0.08, "silent_ones": ["one"] * 20}]})

        names = {"resets-mill": {"machine": "mill", "guard": True}, "resets-it": {"machine": "it"},
                 "flips-mill": {"machine": "mill", "guard": False}, "flips-it": {"machine": "it"}}
        made = {name: {"command": name, "seconds": 1, "resumed": False, "facts": facts(
            name, **more)} for name, more in names.items()}
        text = page({"parts": made, "cores": 2, "versions": []})
        for name in ("mill with guard", "it"):
            assert f"| {name} | 500 | 9 000 | 70 | 10 |" in text
        for name in ("mill without guard", "it"):
            assert f"| {name} | 263 | 1 000 | 600 | 300 | 20 | 80 | 8.000 |" in text

    def test_each_property_has_its_mutant_or_is_named(self):
        found = {"component": "coil", "case": "bench", "clock": 7, "lemma": False, "mutant": ""}
        kills = summary("kills", {"versions": {}, "seconds": 9, "kills": [
            {**found, "name": "moves", "mutant": "not $3 Y[0] inverted"},
            {**found, "name": "counts", "lemma": True}, {**found, "name": "rests"}]})
        assert kills["mutants"] == {"coil": {"moves": "not $3 Y[0] inverted, bench, clock 7"}}
        proof = {"component": "coil", "name": "moves", "description": "It moves.", "case": "-",
                 "verdict": "proved", "k": 2, "base": 1.0, "induction": 0.5}
        proofs = summary("proofs", {"versions": {}, "seconds": 9, "proofs": [
            proof, {**proof, "name": "rests", "k": 5}]})
        found_parts = {name: {"command": name, "seconds": 1, "resumed": False, "facts": facts}
                       for name, facts in (("proofs", proofs), ("kills", kills))}
        text = page({"parts": found_parts, "cores": 2, "versions": []})
        assert "| coil | 2 | 2 | 2 | 5 | 1.5 | 1 of 2 | 1 |" in text
        assert "| coil | rests |" in text
        assert "2 properties in all, of 1 different sentences" in text
        del found_parts["kills"]
        text = page({"parts": found_parts, "cores": 2, "versions": [], "left_out": ["kills"]})
        assert "| coil | 2 | 2 | 2 | 5 | 1.5 | - | - |" in text
        assert "Left out of this record: kills." in text

    def test_json_has_a_line_for_what_holds_nothing_that_holds_more(self):
        facts = {"a": {"b": 1, "c": [1, 2]}, "d": [], "e": [{"f": 1}, {"g": 2}]}
        assert json.loads(dump(facts)) == facts
        assert len(dump(facts).splitlines()) == 11

    def test_long_lists_are_left_out(self):
        assert summary("mutants", {"all": {}, "mutants": {"coil": ["many"]}}) == {"all": {}}


@pytest.mark.parametrize(("arguments", "message"), [
    (["prooofs"], "there is no part 'prooofs'"),
    (["-o", "/nowhere"], "there is no such folder"),
])
def test_says_in_a_line_what_is_wrong(arguments, message, capsys):
    assert main(arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == 1


def test_lists_what_is_run(capsys):
    assert main(["--list", "--quick"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [
        name for name, part in parts().items() if part.quick != ""]
    assert all(re.search(r"python -m (tools|benchmarks)\.", line) for line in lines)
