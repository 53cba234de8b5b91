# amaranth: UnusedElaboratable=no

"""Probing: what it does in which order, whatever the probe, the line and the planner do."""

import random

import pytest

from fresa.motion import AlarmCode, GCodeProbing
from fresa.protocol import GCodeAction, GCodeActionKind, GCodeMotion
from tb.boards import component
from tb.engines import AmaranthEngine

MOTIONS = {2: GCodeMotion.PROBE_TOWARD, 3: GCodeMotion.PROBE_TOWARD_NO_ERROR,
           4: GCodeMotion.PROBE_AWAY, 5: GCodeMotion.PROBE_AWAY_NO_ERROR}
"""By the digit behind G38."""


@pytest.fixture(scope="module")
def probing():
    with AmaranthEngine(component("gcode_probing", GCodeProbing())) as engine:
        yield engine


class Machine:
    """What is around it: a line that is made, brakes, and begins anew, in times at random."""

    def __init__(self, engine, rng: random.Random, *, contact: int, checking: int = 0) -> None:
        self.engine, self.rng = engine, rng
        self.did: list[str] = []
        self.clocks = 0
        self.kept = self.changed = 0  # the clocks in which it was last kept, and the probe changed
        self.alarms: list[AlarmCode] = []
        self.way = 0  # clocks that the line goes on
        self.changes: int | None = None  # clocks until the probe does, once a line is made
        self.contact = contact
        self.begins = self.lists = 0
        self.planned: list[int] = []
        engine.set(rst=1, actions_valid=0, checking=checking, idle=1, standing=1, begins=0,
                   listed=0, passed_ready=0, contact=contact)
        engine.run(1)
        engine.set(rst=0)

    def clock(self) -> bool:
        """Do a clock; return whether the action is taken."""
        engine, rng = self.engine, self.rng
        ready = int(rng.random() < 0.3)
        engine.set(idle=not self.way, standing=not self.way, begins=self.begins > 0,
                   listed=self.lists == 1, passed_ready=ready, contact=self.contact)
        valid, payload, taken, brake, latch, restart, measures, listing, failure = engine.get(
            "passed_valid", "passed_payload", "actions_ready", "brake", "latch",
            "restart", "measures", "listing", "failure")
        if valid and ready:
            self.planned.append(int(payload) & 15)
            self.way = rng.randint(40, 90)
        if self.way and self.changes is not None:
            self.changes -= 1
            if not self.changes:
                self.contact, self.changes = 1 - self.contact, None
                self.changed = self.clocks + 1
        self.way = min(self.way, 5) if brake else self.way
        self.way = max(0, self.way - 1)
        self.begins, self.lists = max(0, self.begins - 1), max(0, self.lists - 1)
        if latch:
            self.kept = self.clocks
            if self.did[-1:] != ["keep"]:
                self.did.append("keep")
        if restart:
            self.did.append("begin there" if measures else "begin here")
            assert not self.way
            self.begins = rng.randint(3, 30)
        if listing:
            self.did.append("list")
            assert not self.begins
            self.lists = rng.randint(1, 20)
        if failure:
            self.alarms.append(AlarmCode(failure))
        engine.run(1)
        self.clocks += 1
        return bool(taken)

    def act(self, kind: GCodeActionKind, motion: GCodeMotion) -> None:
        """Offer an action until it is taken."""
        action = GCodeAction.const({"kind": kind, "modes": {"motion": motion}}).as_bits()
        self.engine.set(actions_valid=1, actions_payload=action)
        assert any(self.clock() for _ in range(400)), "it is not taken"
        self.engine.set(actions_valid=0)

    def probe(self, code: int) -> None:
        """Do G38 with that digit."""
        self.act(GCodeActionKind.PROBE, MOTIONS[code])
        for _ in range(self.rng.randrange(40)):
            self.clock()
        self.act(GCodeActionKind.PROBED, MOTIONS[code])


@pytest.mark.parametrize("code", MOTIONS)
@pytest.mark.parametrize("seed", range(4))
def test_what_it_finds(probing, code, seed):
    machine = Machine(probing, random.Random(f"{code}{seed}"), contact=int(code > 3))
    machine.changes = machine.rng.randint(1, 35)
    machine.probe(code)
    assert machine.did == ["keep", "begin there", "begin here", "list"]
    assert machine.kept == machine.changed
    assert (machine.alarms, machine.planned) == ([], [GCodeActionKind.PROBE.value])
    assert probing.get("touched") == 1


@pytest.mark.parametrize("code", MOTIONS)
def test_what_it_does_not_find(probing, code):
    machine = Machine(probing, random.Random(code), contact=int(code > 3))
    machine.probe(code)
    if code in (3, 5):
        assert machine.did == ["keep", "begin there", "begin here", "list"]
        assert not machine.alarms
    else:
        assert machine.did == ["keep", "begin here", "list"]
        assert machine.alarms == [AlarmCode.PROBE_CONTACT]
    assert probing.get("touched") == 0


@pytest.mark.parametrize("code", MOTIONS)
def test_what_is_there_already(probing, code):
    machine = Machine(probing, random.Random(code), contact=int(code < 4))
    machine.probe(code)
    assert machine.did == ["begin here"] and not machine.planned
    assert machine.alarms == [AlarmCode.PROBE_INITIAL]


def test_it_waits_for_what_was_planned(probing):
    machine = Machine(probing, random.Random(0), contact=0)
    machine.act(GCodeActionKind.LINE, GCodeMotion.LINE)
    machine.way = 200
    machine.act(GCodeActionKind.PROBE, MOTIONS[2])
    assert machine.planned == [GCodeActionKind.LINE.value, GCodeActionKind.PROBE.value]
    assert not machine.did


@pytest.mark.parametrize("contact", [0, 1])
def test_checked_lines_are_planned_and_no_more(probing, contact):
    machine = Machine(probing, random.Random(0), contact=contact, checking=1)
    machine.probe(2)
    machine.act(GCodeActionKind.DWELL, MOTIONS[2])
    assert (machine.did, machine.alarms) == ([], [])
    assert machine.planned == [GCodeActionKind.PROBE.value, GCodeActionKind.DWELL.value]


def test_parameters():
    with pytest.raises(ValueError, match="begins_within"):
        GCodeProbing(begins_within=32)
