"""Fingerprints: they change with what is looked at, and not with how it is written."""

from dataclasses import replace
from typing import Any

import numpy as np

from fresa.drive import FrequencyDivider
from tb.bench import bench
from tb.boards import component
from tb.fuzz.trajectory import Failure
from tb.mistake import Mistake
from tb.models.gcode_machine import MachineModel
from tb.netlist.part import NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable
from tb.registry import fuzz_targets
from tools import fingerprints


def taken(name: str) -> str:
    return fingerprints.take([name], 1)[name]


class TestBench:
    def fingerprint(self, monkeypatch, *, enabled: int = 1, ticks: int = 1) -> str:
        @bench
        def divides(run):
            """A divider."""
            dut = FrequencyDivider(period=3)

            async def test(ctx):
                ctx.set(dut.enable, enabled)
                await ctx.tick().repeat(2)
                run.see(ctx, dut, tick=ticks)

            run.simulate(dut, test)
            return "divided"

        monkeypatch.setattr(fingerprints, "benches", lambda: {"divides": divides})
        monkeypatch.setattr(fingerprints, "groups", lambda: {
            "components": ["divides"], "machine": []})
        monkeypatch.setitem(fingerprints._KINDS, "bench", (lambda: ["divides"],
                                                           fingerprints._bench))
        return taken("bench divides")

    def test_is_what_it_drives_and_expects(self, monkeypatch):
        before = self.fingerprint(monkeypatch)
        assert self.fingerprint(monkeypatch) == before
        fails, passes = (self.fingerprint(monkeypatch, enabled=enabled, ticks=0)
                         for enabled in (1, 0))
        assert len({before, fails, passes}) == 3


def test_session_check_is_what_it_finds_where_nothing_happens(monkeypatch):
    target = replace(fuzz_targets()["single"], others=())

    def fingerprint(check) -> str:
        monkeypatch.setitem(fingerprints._KINDS, "fuzz", (
            lambda: ["single"], lambda name: fingerprints._findings(
                replace(target, session_check=check))))
        return taken("fuzz single")

    def blind(findings, line, seen, floods) -> None:
        """Find nothing."""

    def other(findings, line, seen, floods) -> None:
        findings.failures.append(Failure(0, "answer", "none"))

    before = fingerprint(target.session_check)
    assert len({before, fingerprint(blind), fingerprint(other)}) == 3
    assert fingerprint(target.session_check) == before


def test_a_model_is_what_it_says(monkeypatch):
    before = taken("model gcode")
    assert taken("model gcode") == before
    steps = MachineModel.steps
    monkeypatch.setattr(MachineModel, "steps", lambda model: [
        [(clock + 1, way) for clock, way in axis] for axis in steps(model)])
    assert fingerprints._one("model gcode") != before
    assert fingerprints._one("model mill") == "gone"


class TestNetlist:
    def fingerprint(self, monkeypatch, *, period: int = 4, levels: int = 1, shows: str = "tick",
                    mistake=None) -> str:
        def make():
            return component("divider", FrequencyDivider(period=period))

        def stimulus(seed, clocks, resets):
            yield {"enable": np.full(clocks, levels), "clear": np.zeros(clocks, int)}

        subject = Subject("divider", make, (), shows)
        part = NetlistPart(equal=[subject], codes=[], pins=[], unknown=[
            Runnable("divider", make, stimulus)],
            mistakes={"equal": [(subject.with_mistake(mistake), "")]} if mistake else {})
        monkeypatch.setattr(fingerprints, "netlist_parts", lambda: {"divider": part})
        fingerprints._subjects.cache_clear()
        try:
            return taken("netlist divider")
        finally:
            fingerprints._subjects.cache_clear()

    def test_is_its_design_mistakes_and_what_is_run(self, monkeypatch):
        before = self.fingerprint(monkeypatch)
        assert self.fingerprint(monkeypatch) == before
        others: list[dict[str, Any]] = [
            {"period": 5}, {"levels": 0}, {"shows": "count"}, {"mistake": Mistake("count", init=0)}]
        changed = [self.fingerprint(monkeypatch, **other) for other in others]
        assert len({before, *changed}) == 5


def test_what_is_there_no_more_is_gone():
    assert taken("bench of-nothing") == "gone"
