"""Contract of the states of a G-code machine."""

from amaranth import Cat, Value

from fresa.motion import AlarmCode, GCodeControl
from fresa.protocol import GCodeMessage, GCodeState

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_CONTROL"]

RESET, HOLD, RESUME, STATUS = 0x18, 0x21, 0x7E, 0x3F
CAME = {RESET: "came_reset", HOLD: "came_hold", RESUME: "came_resume", STATUS: "came_status",
        0x84: "came_door", 0x85: "came_jog_cancel"}
"""Registers of commands, by their codes."""


def describe(c: Contract, dut: GCodeControl) -> None:
    """Nothing moves but in the states in which it may, and every request has its effect."""
    state = c.state("control_state")
    stopped, resetting, cancelling, critical, alarmed = (c.signal(name) for name in (
        "stopped", "resetting", "cancelling", "critical", "alarmed"))
    known = c.past(~c.rst)  # no reset of all in the clock before

    def came(code: int) -> Bits:
        return c.signal(CAME[code])

    for code, name in CAME.items():
        c.implication(f"{name.replace('_', '-')}", "A command counts in the clock after it.",
                      when=c.past(1), then=came(code) == c.past(
                          ~c.rst & dut.command & (dut.code == code)))
    c.implication("moves-in-few-states", "Blocks may begin or go on only in IDLE, RUN, JOG, HOME.",
                  when=~dut.hold, then=state("IDLE", "RUN", "JOG", "HOME") & ~resetting)
    c.implication("rest-of-them-hold", "In those, only a reset or a cancelled jog slows down.",
                  when=state("IDLE", "RUN", "JOG", "HOME") & ~resetting & ~cancelling,
                  then=~dut.hold)
    c.implication("state-shown", "What is shown as RUN, JOG or HOME may move.",
                  when=Cat(dut.state == shown for shown in (
                      GCodeState.RUN, GCodeState.JOG, GCodeState.HOME)).any(),
                  then=~dut.hold | cancelling)
    c.implication("hold-in-a-clock", "A feed hold holds in the next clock.",
                  when=known & c.past(came(HOLD) & state("IDLE", "RUN") & ~dut.reset),
                  then=dut.hold & state("HOLD", "DOOR", "ALARM"))
    c.implication("door-in-a-clock", "So does an open door.",
                  when=known & c.past(dut.door & state("IDLE", "RUN", "HOLD", "JOG", "HOME",
                                                       "RENEW")),
                  then=dut.hold | c.past(cancelling))
    c.implication("door-stays", "With the door open nothing resumes.",
                  when=known & c.past(dut.door & state("DOOR", "RENEW") & ~dut.reset),
                  then=state("DOOR", "ALARM"))
    c.implication("door-lasts", "It lasts until a resume while it stands, closed, or a reset.",
                  when=known & c.past(state("DOOR") & ~(came(RESUME) & dut.standing) & ~dut.reset),
                  then=state("DOOR", "ALARM"))
    c.implication("accessories-first", "Then nothing moves before accessories are on again.",
                  when=known & c.past(state("DOOR", "RENEW") & ~dut.reset) & ~state(
                      "DOOR", "RENEW", "ALARM"),
                  then=c.past(state("RENEW") & dut.restarted & ~dut.door) & state("IDLE"))
    c.implication("accessories-asked-for", "They are turned on where it says so, and nothing "
                  "else is said to be that.",
                  when=state("RENEW") | ((dut.state == GCodeState.DOOR) & dut.substate.all()),
                  then=state("RENEW") & (dut.state == GCodeState.DOOR) & dut.substate.all())
    c.implication("off-is-door", "Where something is still off nothing begins: it is DOOR again.",
                  when=known & c.past(state("IDLE") & ~dut.restarted & ~dut.reset),
                  then=state("DOOR", "ALARM"))
    c.implication("off-where-it-stands", "With the door open they are off where it stands.",
                  when=state("DOOR"), then=dut.substate[1] == ~dut.standing)
    c.implication("says-that-it-is-open", "That the door opens is said, also once more.",
                  when=known & c.past((dut.door & ~c.past(dut.door & ~c.rst) & state("DOOR"))
                                      | (dut.door & state("RENEW", "IDLE", "RUN", "HOLD"))
                                      | (came(0x84) & state("JOG", "SLEEP", "DOOR"))),
                  then=c.signal("wants_check_door"))
    c.implication("hold-stays", "A hold lasts until a resume while it stands, or a reset.",
                  when=known & c.past(state("HOLD") & ~(came(RESUME) & dut.standing) & ~dut.reset),
                  then=state("HOLD", "DOOR", "ALARM"))
    c.implication("resumes", "Then it ends.",
                  when=known & c.past(state("HOLD") & came(RESUME) & dut.standing & ~dut.door),
                  then=state("IDLE", "ALARM", "START"))
    c.implication("emergency-stops", "The emergency stop stops in the next clock.",
                  when=known & c.past(dut.emergency), then=dut.stop)
    c.implication("limit-stops", "So does a hard limit, outside of homing.",
                  when=known & c.past((dut.limits & ~c.past(dut.limits)).any() & dut.hard
                                      & ~c.past(c.rst)
                                      & state("IDLE", "RUN", "HOLD", "JOG", "DOOR", "RENEW",
                                              "CHECK")),
                  then=dut.stop & critical)
    c.implication("stop-until-reset", "What is stopped stays so until a reset takes effect.",
                  when=known & c.past(stopped & ~dut.reset), then=stopped & dut.stop)
    c.implication("stops-for-a-reason", "Nothing else stops.",
                  when=dut.stop & ~stopped & ~dut.fault, then=c.past(dut.emergency))
    c.implication("critical-holds", "An alarm that needs a reset holds.",
                  when=critical, then=alarmed & state("ALARM", "START") & dut.hold)
    c.implication("critical-is-named", "Those are of limits, and of the emergency stop.",
                  when=known & critical & ~c.past(critical), then=Cat(
                      c.past(c.signal("alarm")) == code for code in (
                          AlarmCode.HARD_LIMIT, AlarmCode.SOFT_LIMIT, AlarmCode.EMERGENCY,
                          AlarmCode.MOTOR_FAULT)).any() & c.signal("wants_reset_to_continue"))
    c.implication("soft-limit-is-critical", "A soft limit is.",
                  when=known & c.past(c.signal("alarm") == AlarmCode.SOFT_LIMIT),
                  then=critical)
    c.implication("limit-at-a-start", "A limit switch that is on at a start locks, and is said.",
                  when=known & c.past(state("START") & dut.limits.any() & dut.hard),
                  then=state("ALARM") & alarmed & c.signal("wants_check_limits"))
    c.implication("failed-homing-resets", "A homing cycle that failed resets by itself.",
                  when=known & c.past(state("HOME") & Cat(
                      c.signal("alarm") == code for code in (
                          AlarmCode.HOMING_RESET, AlarmCode.HOMING_DOOR,
                          AlarmCode.HOMING_PULL_OFF, AlarmCode.HOMING_SEARCH)).any()
                                      & ~dut.reset), then=resetting)
    c.implication("alarm-holds", "An alarm lasts until unlock, homing, sleep, or a reset.",
                  when=known & c.past(state("ALARM") & ~dut.reset & ~(
                      (dut.unlock | dut.home | dut.sleep) & ~critical & ~cancelling)),
                  then=state("ALARM"))
    c.implication("alarm-is-remembered", "It is there again after a reset.",
                  when=state("ALARM") | (known & c.past(state("SLEEP"))), then=alarmed)
    c.implication("locked-after-start", "And nothing moves then.",
                  when=known & c.past(state("START") & alarmed), then=state("ALARM"))
    c.implication("no-block-survives-an-alarm", "Before an alarm ends, the blocks are discarded.",
                  when=known & c.past(state("ALARM")) & ~state("ALARM", "START"),
                  then=c.past(~cancelling))
    c.implication("flush-at-a-stand", "Blocks are discarded only where it stands, in an alarm.",
                  when=dut.flush, then=dut.standing & cancelling & state("ALARM"))
    c.implication("nothing-left-of-a-probing", "Those of a probing discard nothing.",
                  when=known & c.past(((c.signal("alarm") == AlarmCode.PROBE_INITIAL)
                                       | (c.signal("alarm") == AlarmCode.PROBE_CONTACT))
                                      & ~cancelling & ~state("JOG")), then=~cancelling)
    c.implication("cancelled-at-a-stand", "Those of a jog likewise, in JOG.",
                  when=dut.cancelled, then=dut.standing & cancelling & state("JOG"))
    c.implication("cancels", "A jog that is cancelled ends so, unless a reset or an alarm comes.",
                  when=known & c.past(state("JOG") & cancelling) & state("IDLE", "DOOR"),
                  then=c.past(dut.cancelled))
    c.implication("reset-taken", "A reset takes effect as soon as it stands, or is stopped.",
                  when=resetting & (dut.standing | stopped), then=dut.reset)
    c.implication("reset-only-then", "And neither sooner nor unless it was requested.",
                  when=dut.reset, then=(dut.standing | stopped) & resetting)
    c.implication("reset-requested", "A request waits, and holds.",
                  when=known & c.past((came(RESET) | dut.restart) & ~dut.reset),
                  then=resetting & dut.hold)
    c.implication("reset-waits", "It waits until it takes effect.",
                  when=known & c.past(resetting & ~dut.reset), then=resetting)
    c.implication("no-other-reset", "Nothing else makes one.",
                  when=resetting, then=c.past(resetting | came(RESET) | dut.restart
                                              | (state("HOME") & (c.signal("alarm") != 0))))
    c.implication("strict-reset", "A strict one that comes while it moves stops in the next clock.",
                  when=known & c.past(came(RESET) & dut.strict & ~dut.standing
                                      & state("RUN", "JOG", "HOME", "HOLD", "DOOR", "RENEW",
                                              "IDLE")),
                  then=dut.stop & alarmed)
    c.implication("starts-after-reset", "A reset starts anew: with the greeting.",
                  when=known & c.past(dut.reset),
                  then=state("START") & ~resetting & (critical == c.past(
                      c.signal("breaks") | (c.signal("alarm") == AlarmCode.SOFT_LIMIT))))
    c.implication("greets", "The greeting follows a start.",
                  when=known & c.past(state("START")), then=c.signal("wants_greeting"))
    c.implication("says-it", "A message that is wanted is offered as soon as there is room.",
                  when=known & c.past(c.signal("wants_greeting")
                                      & (~dut.messages.valid | dut.messages.ready)),
                  then=dut.messages.valid & (dut.messages.payload == GCodeMessage.GREETING))
    for name, when in [
            ("unlocked", state("ALARM") & dut.unlock & ~critical & ~cancelling
             & ~(dut.sleep | dut.home)),
            ("program_end", dut.ended),
            ("restoring_spindle", dut.spindle_restored & ~state("RENEW")),
            ("disabled", state("CHECK") & ~dut.check), ("restoring", dut.restoring)]:
        c.implication(f"says-{name}", "What has been done is said.", when=known & c.past(when),
                      then=c.signal(f"wants_{name}"))
    c.implication("says-where-it-went", "So it is when sleep or check mode begins.",
                  when=known & c.past(known) & c.past(state("IDLE")),
                  then=(~state("SLEEP") | c.signal("wants_sleeping"))
                  & (~state("CHECK") | c.signal("wants_enabled")))
    c.implication("report-requested", "Each request for a report is passed on at once.",
                  when=came(STATUS) | dut.report, then=came(STATUS) & dut.report)
    alarm = c.signal("alarm")
    c.implication("alarm-announced", "An alarm is announced, unless another waits.",
                  when=known & c.past((alarm != AlarmCode.NONE)
                                      & (~dut.alarms.valid | dut.alarms.ready)),
                  then=dut.alarms.valid & (dut.alarms.payload == c.past(alarm)))
    c.implication("motor-fault-named", "An emergency stop by a driver is an alarm of its own.",
                  when=(alarm == AlarmCode.MOTOR_FAULT) & (dut.failure == AlarmCode.NONE),
                  then=dut.emergency & dut.motor_fault)
    c.implication("emergency-named", "And that by a person is none of a driver.",
                  when=(alarm == AlarmCode.EMERGENCY) & (dut.failure == AlarmCode.NONE),
                  then=dut.emergency & ~dut.motor_fault)
    c.implication("alarm-begins", "And is there in the next clock.",
                  when=known & c.past((alarm != AlarmCode.NONE) & ~dut.reset),
                  then=state("ALARM") & alarmed)
    c.implication("no-other-alarm", "Nothing else is announced.",
                  when=dut.alarms.valid & known & c.past(~dut.alarms.valid),
                  then=c.past(alarm != AlarmCode.NONE))
    c.implication("announced-once", "An alarm that is taken is not announced again.",
                  when=known & c.past(dut.alarms.valid & dut.alarms.ready
                                      & (alarm == AlarmCode.NONE)), then=~dut.alarms.valid)
    for name in ("alarms", "messages"):
        stream = getattr(dut, name)
        payload = Value.cast(stream.payload)
        c.implication(f"{name}-stable-until-ready", "What is offered stays until it is taken.",
                      when=known & c.past(stream.valid & ~stream.ready),
                      then=stream.valid & (payload == c.past(payload)))
    c.implication("motors-off", "Asleep, or with the emergency stop, the motors are off.",
                  when=known & c.past(state("SLEEP") | dut.emergency), then=~dut.enable)
    c.implication("motors-on", "What moves has its motors on.",
                  when=known & c.past(state("RUN", "JOG", "HOME") & ~dut.emergency),
                  then=dut.enable)
    c.implication("reset-clears", "The reset of all starts anew.", when=c.past(c.rst),
                  then=state("START") & ~resetting & ~stopped & ~dut.enable & ~dut.alarms.valid
                  & ~dut.messages.valid & ~alarmed)
    c.leaves_unused_codes("control_state", fault=dut.fault,
                          shows=dut.stop & dut.hold & ~dut.reset & ~dut.flush
                          & ~dut.cancelled)


GCODE_CONTROL = Component(make=GCodeControl, describe=describe, depth=16,
                          cases=(Case(), Case(upset=True)))
