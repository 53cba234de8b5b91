# pyright: reportInvalidTypeForm=false

"""The command that measures coverage, and what it measures with."""

import json
import threading
from dataclasses import replace
from typing import Any

import pytest
from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.fsm import leave_unused_codes
from tb import coverage
from tb.boards import component
from tb.contracts import Component
from tb.engines.coverage import CoverageEngine, NamedCoverageEngine
from tb.machine import Coverage
from tb.machines import machines
from tb.registry import components, duts
from tools.coverage import main


class Lamp(wiring.Component):
    """A state machine of three states: the way that leads out of GREEN is never open."""

    go: In(1)
    lit: Out(1)

    def elaborate(self, platform):
        m: Any = Module()
        idle = Signal()
        with m.FSM(name="lamp") as fsm:
            with m.State("RED"):
                with m.If(self.go):
                    m.next = "GREEN"
            with m.State("GREEN"):
                with m.If(self.go & idle):  # nothing sets it
                    m.next = "RED"
            with m.State("FAULT"):
                pass
        m.d.comb += self.lit.eq(leave_unused_codes(m, fsm, fault="FAULT") | fsm.ongoing("GREEN"))
        return m


def describe(c, dut):
    """Promise nothing."""
    c.any_code("lamp")


LAMP = Component(make=Lamp, describe=describe, depth=6, cases=(
    coverage.Case(), coverage.Case(upset=True)))


class TestStates:
    @pytest.mark.long
    def test_finds_the_state_machines_by_their_mark(self):
        found = coverage.with_state_machine()
        assert {"profile", "start", "gcode_interpreter"} <= set(found)
        assert not {"divider", "axes", "walk"} & set(found)

    @pytest.mark.prover
    def test_tells_what_is_reached_and_when_from_what_is_not(self, tmp_path):
        points = coverage.cover_states("lamp", [LAMP], tmp_path, threading.Lock())
        assert {(point.kind, point.name): (point.clock is not None, point.upset)
                for point in points} == {
            ("state", "RED"): (True, False),
            ("state", "GREEN"): (True, False),
            ("state", "FAULT"): (True, True),
            ("transition", "RED -> GREEN"): (True, False),
            ("transition", "GREEN -> RED"): (False, False),
            ("transition", "unused codes -> FAULT"): (True, True)}

    @pytest.mark.prover
    @pytest.mark.parametrize("depth", [1, 6])
    def test_finds_what_a_contract_keeps_its_own_covers_from(self, tmp_path, depth):
        def restricted(c, dut):
            describe(c, dut)
            c.restrict_covers(~dut.go)

        lamp = replace(LAMP, describe=restricted, depth=depth)
        points = coverage.cover_states("lamp", [lamp], tmp_path, threading.Lock())
        assert [point.name for point in points if point.clock is None] == ["GREEN -> RED"]
        assert next(point.clock for point in points if point.name == "RED -> GREEN") == 1

    @pytest.mark.prover
    def test_every_state_and_transition_is_reached(self, monkeypatch, tmp_path, capsys):
        """Of two components; all are a part of the record."""
        monkeypatch.setattr("tools.coverage.with_state_machine", lambda: {
            name: [components()[name]] for name in ("sequencer", "start")})
        assert main(["states", "--json", str(tmp_path / "states.json")]) == 0
        points = json.loads((tmp_path / "states.json").read_text())["states"]
        assert {point["component"] for point in points} == {"sequencer", "start"}
        assert all(point["clock"] is not None for point in points)
        assert "sequencer       10 of  10 states" in capsys.readouterr().out

    @pytest.mark.prover
    def test_fails_when_one_is_not_reached(self, monkeypatch, capsys):
        monkeypatch.setattr("tools.coverage.with_state_machine", lambda: {"lamp": [LAMP]})
        assert main(["states", "--verbose"]) == 1
        printed = capsys.readouterr().out
        assert "  NOT REACHED: transition GREEN -> RED" in printed
        assert "  clock   1: state GREEN" in printed


@pytest.mark.verilator
@pytest.mark.compiler
class TestLines:
    def test_counts_lines_branches_and_bits(self):
        with CoverageEngine(component("lamp", Lamp())) as engine:
            engine.set(rst=1)
            engine.run(2)
            engine.set(rst=0)
            engine.run(2)
            before = {(point.kind, point.what): point.count for point in engine.points()}
            engine.set(go=1)
            engine.run(2)
            after = {(point.kind, point.what): point.count for point in engine.points()}
        assert before["toggle", "lit"] == 0
        assert after["toggle", "lit"] == 1
        assert after["toggle", "go"] == 1
        taken = {what for (kind, what), count in after.items() if kind == "branch" and count}
        assert {"if of if (go) begin", "else of if (go) begin"} <= taken
        assert not any("verilog_backend" in what or what.startswith(("reg ", "always"))
                       for _, what in after)

    def test_of_a_large_machine_only_what_has_a_name(self):
        design = component("lamp", Lamp())
        with CoverageEngine(design) as engine:
            every = {point.what for point in engine.points() if point.kind == "toggle"}
        with NamedCoverageEngine(design) as engine:
            points = engine.points()
        named = {point.what for point in points if point.kind == "toggle"}
        assert {"lit", "go"} <= named < every
        assert any(point.kind == "branch" for point in points)
        assert not any("$" in what for what in named)

    def test_the_cosimulation_comes_by_what_is_asked(self, tmp_path, capsys):
        facts = tmp_path / "lines.json"
        assert main(["lines", "--cycles", "200000", "--json", str(facts)]) == 0
        lines = json.loads(facts.read_text())["lines"]
        assert lines["lines and branches"]["percent"] >= 98
        assert lines["bits"]["percent"] >= 98
        assert len(lines["never"]) == sum(
            lines[what]["all"] - lines[what]["seen"] for what in ("lines and branches", "bits"))

    def test_fails_below_what_is_asked(self, capsys):
        assert main(["lines", "--cycles", "10", "--least", "100"]) == 1
        printed = capsys.readouterr().out
        assert "never: " in printed and "NOT 100 % of bits" in printed

    def test_of_another_machine_what_it_declares(self, tmp_path, monkeypatch):
        facts = tmp_path / "lines.json"
        arguments = ["lines", "--machine", "single", "--cycles", "4", "--json", str(facts)]
        for least, status in ((10, 0), (99.9, 1)):
            monkeypatch.setitem(machines(), "single", replace(
                machines()["single"], coverage=Coverage(1, least, least)))
            small = {"single": duts()["divider"]}
            monkeypatch.setattr("tb.coverage.duts", lambda small=small: small)
            assert main(arguments) == status
            lines = json.loads(facts.read_text())["lines"]
            assert (lines["machine"], lines["clocks"]) == ("single", 4)
            assert lines["bits"]["least"] == least
        assert any(point["module"].startswith("frequency_divider.dut") for point in lines["never"])


@pytest.mark.parametrize(("arguments", "message"), [
    (["sates"], "there is no measure 'sates'"),
    (["lines", "--machine", "lathe"], "invalid choice: 'lathe'"),
    (["--least", "101"], "must be 0 to 100"),
    (["--cycles", "0"], "must be a whole number from 1"),
    (["--json", "/nowhere/facts.json"], "its folder does not exist"),
])
def test_says_in_a_line_what_is_wrong(arguments, message, capsys):
    assert main(arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == 1


def test_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr("tools.coverage.missing", lambda: "z3-solver missing: pip install it")
    assert main(["states"]) == 2
    assert "z3-solver missing" in capsys.readouterr().err
