# amaranth: UnusedElaboratable=no

"""States of a G-code machine: every clock against the model, and its ways one by one."""

import random

import pytest

from fresa.motion import AlarmCode, GCodeControl
from fresa.protocol import GCodeMessage, GCodeState, RealtimeCode
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.gcode_control import LEVELS, PULSES, ControlModel, control_inputs

OUTPUTS = ("hold", "stop", "critical", "state", "substate", "report", "reset", "flush",
           "cancelled", "enable", "fault", "alarms_valid", "alarms_payload", "messages_valid",
           "messages_payload")


@pytest.mark.parametrize("seed", range(3))
def test_every_clock(seed):
    columns = control_inputs(random.Random(seed), 4000)
    with AmaranthEngine(component("control", GCodeControl())) as engine:
        seen = engine.apply(columns, list(OUTPUTS))
    model, states = ControlModel(), set()
    for clock, row in enumerate(zip(*columns.values(), strict=True)):
        states.add(model.state)
        for name, value in model(**dict(zip(columns, row, strict=True))).items():
            assert value is None or int(seen[name][clock]) == value, (clock, name)
    assert states == {"START", *(state.name for state in GCodeState)}


class Machine:
    """A machine that takes some clocks to slow down."""

    def __init__(self, engine, **levels: int) -> None:
        self.engine = engine
        self.speed = self.wants = 0
        engine.set(**{**dict.fromkeys([*LEVELS, *PULSES, "code", "failure", "limits"], 0),
                      "alarms_ready": 1, "messages_ready": 1, "hard": 1, "standing": 1,
                      "restarted": 1, **levels, "rst": 1})
        engine.run(1)
        engine.set(rst=0)
        self.messages, self.alarms = [], []
        self.resets = self.flushes = self.cancelled = 0

    def run(self, clocks: int = 1, **inputs: int) -> str:
        """Run some clocks, the first with these pulses; return what a report shows."""
        self.wants = inputs.get("moving", self.wants)
        self.engine.set(**inputs)
        for _ in range(clocks):
            names = ("hold", "stop", "reset", "flush", "cancelled", "alarms_valid",
                     "alarms_payload", "messages_valid", "messages_payload")
            now = dict(zip(names, map(int, self.engine.get(*names)), strict=True))
            self.alarms += [AlarmCode(now["alarms_payload"])] * now["alarms_valid"]
            self.messages += [GCodeMessage(now["messages_payload"])] * now["messages_valid"]
            self.resets += now["reset"]
            self.flushes += now["flush"]
            self.cancelled += now["cancelled"]
            if now["reset"] or now["flush"] or now["cancelled"]:
                self.speed, self.wants = 0, 0
            elif now["hold"] or not self.wants:
                self.speed = max(self.speed - 1, 0)
            else:
                self.speed = min(self.speed + 1, 5)
            self.engine.run(1)
            self.engine.set(command=0, pause=0, sleep=0, unlock=0, restart=0, restoring=0,
                            ended=0, spindle_restored=0, failure=0, standing=int(self.speed == 0),
                            moving=int(self.wants or self.speed > 0))
        state, substate = self.engine.get("state", "substate")
        state = GCodeState(int(state))
        return state.name + (f":{substate}" if state in (GCodeState.HOLD, GCodeState.DOOR) else "")

    def command(self, code: RealtimeCode, clocks: int = 1) -> str:
        """Let a command come, then run some clocks, in the first of which it counts."""
        self.run(1, command=1, code=code.value)
        return self.run(clocks)


@pytest.fixture(scope="module")
def engine():
    with AmaranthEngine(component("control", GCodeControl())) as engine:
        yield engine


def test_hold_and_resume(engine):
    machine = Machine(engine)
    assert machine.run(4) == "IDLE"
    assert machine.run(8, moving=1) == "RUN"
    assert machine.command(RealtimeCode.HOLD) == "HOLD:1"
    assert machine.command(RealtimeCode.RESUME) == "HOLD:1"
    assert machine.run(8) == "HOLD:0"
    assert machine.command(RealtimeCode.RESUME, 8) == "RUN"
    assert machine.run(8, moving=0) == "IDLE"
    assert machine.command(RealtimeCode.HOLD) == "HOLD:0"
    assert machine.command(RealtimeCode.RESUME) == "IDLE"
    assert (machine.messages, machine.alarms) == ([GCodeMessage.GREETING], [])


def test_program_pause(engine):
    machine = Machine(engine)
    assert machine.run(8) == "IDLE"
    assert machine.run(1, pause=1) == "HOLD:0"
    assert machine.run(8, moving=1) == "HOLD:0"
    assert machine.command(RealtimeCode.RESUME, 3) == "RUN"


def test_door_stays_until_it_is_closed(engine):
    machine = Machine(engine)
    machine.run(8, moving=1)
    assert machine.run(1, door=1) == "DOOR:2"
    assert machine.run(8) == "DOOR:1"
    assert machine.command(RealtimeCode.RESUME) == "DOOR:1"
    assert machine.run(1, door=0) == "DOOR:0"
    assert machine.command(RealtimeCode.RESUME, 4) == "RUN"
    assert machine.messages == [GCodeMessage.GREETING, GCodeMessage.CHECK_DOOR]


def test_behind_the_door_it_waits_for_what_was_turned_off(engine):
    machine = Machine(engine)
    machine.run(8, moving=1)
    machine.run(8, door=1, restarted=0)
    machine.run(1, door=0)
    assert machine.command(RealtimeCode.RESUME, 8) == "DOOR:3"
    assert machine.command(RealtimeCode.HOLD, 8) == "DOOR:3"
    assert machine.run(1, door=1) == "DOOR:1"
    assert machine.run(1, door=0) == "DOOR:0"
    assert machine.command(RealtimeCode.DOOR, 8) == "DOOR:0"
    assert machine.command(RealtimeCode.RESUME, 8) == "DOOR:3"
    assert machine.run(2, restarted=1) == "RUN"
    assert machine.messages == [GCodeMessage.GREETING, *[GCodeMessage.CHECK_DOOR] * 3]


def test_what_is_still_off_behind_an_alarm_is_turned_on_by_a_resume_alone(engine):
    machine = Machine(engine)
    machine.run(8, door=1, restarted=0)
    assert machine.run(8, failure=4) == "ALARM"
    assert machine.run(8, unlock=1, door=0) == "DOOR:0"
    assert machine.command(RealtimeCode.RESUME, 8) == "DOOR:3"
    assert machine.run(2, restarted=1) == "IDLE"


def test_reset_slows_down_and_keeps_the_position(engine):
    machine = Machine(engine)
    machine.run(8, moving=1)
    assert machine.command(RealtimeCode.RESET) == "HOLD:1"
    assert (machine.run(3), machine.resets) == ("HOLD:1", 0)
    assert machine.run(10) == "IDLE"
    assert (machine.resets, machine.alarms) == (1, [])
    assert machine.messages == [GCodeMessage.GREETING] * 2


def test_strict_reset_is_an_alarm(engine):
    machine = Machine(engine, strict=1)
    machine.run(8, moving=1)
    machine.command(RealtimeCode.RESET)
    assert engine.get("stop")
    assert machine.run(8) == "ALARM"
    assert (machine.resets, machine.alarms) == (1, [AlarmCode.ABORTED])
    assert machine.messages[1:] == [GCodeMessage.GREETING, GCodeMessage.LOCKED]
    assert machine.run(1, unlock=1) == "IDLE"


@pytest.mark.parametrize(("cause", "alarm"), [
    ("limits", AlarmCode.HARD_LIMIT), ("emergency", AlarmCode.EMERGENCY)])
def test_stops_at_once_and_needs_a_reset(engine, cause, alarm):
    machine = Machine(engine)
    machine.run(8, moving=1)
    assert not engine.get("stop")
    assert machine.run(1, **{cause: 1}) == "ALARM"
    assert engine.get("stop")
    assert machine.run(1, unlock=1) == "ALARM"
    assert machine.run(20, **{cause: 0}) == "ALARM"
    assert machine.run(1, unlock=1) == "ALARM"
    assert engine.get("stop")
    machine.command(RealtimeCode.RESET)
    assert (machine.run(8), machine.alarms) == ("ALARM", [alarm])
    assert not engine.get("stop")
    assert machine.run(1, unlock=1) == "IDLE"


def test_emergency_stop_that_stays_is_an_alarm_again_after_reset(engine):
    machine = Machine(engine, emergency=1)
    assert machine.run(4) == "ALARM"
    machine.command(RealtimeCode.RESET, 8)
    assert engine.get("stop")
    assert machine.run(1, unlock=1) == "ALARM"
    assert machine.alarms == [AlarmCode.EMERGENCY] * 2


def test_a_driver_that_stops_has_an_alarm_of_its_own(engine):
    machine = Machine(engine, emergency=1, motor_fault=1)
    assert machine.run(4) == "ALARM"
    assert machine.alarms == [AlarmCode.MOTOR_FAULT]


def test_failure_slows_down_and_discards(engine):
    machine = Machine(engine)
    machine.run(8, moving=1)
    assert machine.run(1, failure=9) == "ALARM"
    assert not engine.get("stop")
    assert machine.run(1, unlock=1) == "ALARM"
    assert (machine.run(8), machine.flushes) == ("ALARM", 1)
    assert machine.run(1, unlock=1) == "IDLE"
    assert machine.alarms == [AlarmCode.HOMING_SEARCH]


def test_soft_limit_slows_down_and_needs_a_reset(engine):
    machine = Machine(engine)
    machine.run(8, moving=1)
    assert machine.run(1, failure=2) == "ALARM"
    assert not engine.get("stop")
    assert engine.get("critical")
    assert (machine.run(8), machine.flushes) == ("ALARM", 1)
    assert machine.run(1, unlock=1) == "ALARM"
    assert machine.alarms == [AlarmCode.SOFT_LIMIT]
    machine.command(RealtimeCode.RESET, 8)
    assert not engine.get("critical")
    assert machine.messages[1:] == [
        GCodeMessage.RESET_TO_CONTINUE, GCodeMessage.GREETING, GCodeMessage.LOCKED]
    assert machine.run(1, unlock=1) == "IDLE"


def test_limit_switch_that_is_on_at_a_start_locks_without_an_alarm(engine):
    machine = Machine(engine, limits=0b010)
    assert machine.run(6) == "ALARM"
    assert machine.run(1, unlock=1) == "IDLE"
    assert machine.run(4, moving=1) == "RUN"
    assert machine.messages == [
        GCodeMessage.GREETING, GCodeMessage.CHECK_LIMITS, GCodeMessage.LOCKED,
        GCodeMessage.UNLOCKED]
    assert not machine.alarms
    machine.run(4, limits=0b011)  # the switch of another axis
    assert machine.alarms == [AlarmCode.HARD_LIMIT]


def test_switches_are_no_alarm_where_they_are_no_hard_limits(engine):
    machine = Machine(engine, hard=0)
    machine.run(4, moving=1)
    assert machine.run(4, limits=0b100) == "RUN"
    assert machine.run(4, hard=1) == "RUN"
    assert not machine.alarms


def test_homing_cycle_that_failed_starts_anew(engine):
    machine = Machine(engine)
    machine.run(4)
    machine.run(8, home=1, moving=1)
    machine.run(1, failure=9)
    assert machine.run(12, home=0) == "ALARM"
    assert (machine.resets, machine.alarms) == (1, [AlarmCode.HOMING_SEARCH])
    assert machine.messages[1:] == [GCodeMessage.GREETING, GCodeMessage.LOCKED]
    assert machine.run(1, unlock=1) == "IDLE"


def test_door_of_a_jog_is_said_at_once(engine):
    machine = Machine(engine, jogging=1)
    machine.run(8, moving=1)
    machine.messages.clear()
    assert machine.run(3, door=1) == "JOG"
    assert machine.messages == [GCodeMessage.CHECK_DOOR]
    assert machine.run(10) == "DOOR:1"
    assert machine.messages == [GCodeMessage.CHECK_DOOR]
    machine.run(2, door=0)
    machine.command(RealtimeCode.DOOR, 4)
    assert machine.messages == [GCodeMessage.CHECK_DOOR] * 2


def test_jog_is_cancelled(engine):
    machine = Machine(engine, jogging=1)
    assert machine.run(8, moving=1) == "JOG"
    assert machine.command(RealtimeCode.HOLD) == "JOG"
    assert (machine.run(10), machine.cancelled) == ("IDLE", 1)
    machine.run(8, moving=1)
    machine.command(RealtimeCode.DOOR)
    assert (machine.run(10), machine.cancelled, machine.flushes) == ("DOOR:0", 2, 0)


def test_homing_ends_a_lock(engine):
    machine = Machine(engine, locked_start=1)
    assert machine.run(4) == "ALARM"
    assert machine.messages == [GCodeMessage.GREETING, GCodeMessage.LOCKED]
    assert machine.run(4, home=1, moving=1, limits=1) == "HOME"
    assert machine.run(4, home=0, moving=0, limits=0) == "IDLE"
    assert machine.command(RealtimeCode.RESET, 8) == "IDLE"
    machine.run(4, home=1, moving=1)
    machine.command(RealtimeCode.RESET)
    assert machine.run(12, home=0) == "ALARM"
    assert machine.alarms == [AlarmCode.HOMING_RESET]


def test_sleep_ends_by_a_reset(engine):
    machine = Machine(engine)
    machine.run(8, moving=1)
    assert engine.get("enable")
    machine.run(8, moving=0)
    assert machine.run(2, sleep=1) == "SLEEP"
    assert not engine.get("enable")
    assert machine.run(8, unlock=1, moving=1) == "SLEEP"
    machine.command(RealtimeCode.RESET, 20)
    assert machine.run(1) == "ALARM"


def test_what_is_done_is_said(engine):
    machine = Machine(engine)
    machine.run(4)
    machine.messages.clear()
    assert machine.run(6, check=1) == "CHECK"
    assert machine.run(6, check=0) == "IDLE"
    machine.run(6, restoring=1)
    machine.run(6, restart=1)
    machine.run(2, failure=9)
    assert machine.run(6, unlock=1) == "IDLE"
    assert machine.run(6, sleep=1) == "SLEEP"
    assert machine.resets == 1
    assert machine.messages == [
        GCodeMessage.ENABLED, GCodeMessage.DISABLED, GCodeMessage.RESTORING,
        GCodeMessage.GREETING, GCodeMessage.UNLOCKED, GCodeMessage.SLEEPING]
