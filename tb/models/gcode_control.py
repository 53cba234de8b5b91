"""States of a G-code machine, clock by clock, from the description of `GCodeControl`."""

import random
from dataclasses import dataclass, field

__all__ = ["LEVELS", "PULSES", "ControlModel", "control_inputs"]

STATES = ("IDLE", "RUN", "HOLD", "JOG", "ALARM", "DOOR", "CHECK", "HOME", "SLEEP")
GREETING, LOCKED, UNLOCKED, ENABLED, DISABLED, RESET_TO_CONTINUE, CHECK_DOOR = range(7)
PROGRAM_END, SLEEPING, RESTORING, CHECK_LIMITS, RESTORING_SPINDLE = range(7, 12)
ORDER = (GREETING, CHECK_LIMITS, LOCKED, RESET_TO_CONTINUE, CHECK_DOOR, UNLOCKED, ENABLED,
         DISABLED, SLEEPING, RESTORING, RESTORING_SPINDLE, PROGRAM_END)
SAYS = {"SLEEP": SLEEPING, "CHECK": ENABLED}
HARD_LIMIT, SOFT_LIMIT, ABORTED, PROBE_INITIAL, PROBE_CONTACT = 1, 2, 3, 4, 5
HOMING_RESET, HOMING_DOOR = 6, 7
EMERGENCY, MOTOR_FAULT = 10, 17
RESET, HOLD, RESUME, STATUS, DOOR, JOG_CANCEL = 0x18, 0x21, 0x7E, 0x3F, 0x84, 0x85
LEVELS = ("moving", "standing", "jogging", "home", "check", "door", "hard", "emergency",
          "motor_fault", "strict", "locked_start", "restarted")
PULSES = ("pause", "sleep", "unlock", "command", "alarms_ready", "messages_ready", "restart",
          "restoring", "ended", "spindle_restored", "rst")


@dataclass
class ControlModel:
    """Call it once a clock, with the inputs by name; it returns the outputs in that clock."""

    state: str = "START"
    locked: bool = False
    first: bool = True
    stopped: bool = False
    critical: bool = False
    resetting: bool = False
    cancelling: bool = False
    door_next: bool = False
    renewing: bool = False
    door_before: int = 0
    enabled: bool = False
    limits_before: int = 0
    emergency_before: int = 0
    came: int | None = None
    alarm_line: int | None = None
    message: int | None = None
    to_say: list[int] = field(default_factory=list)

    def __call__(self, *, rst: int, command: int, code: int, alarms_ready: int,
                 messages_ready: int, **inputs: int) -> dict[str, int | None]:
        came, self.came = self.came, code if command else None
        asks_reset = came == RESET or inputs["restart"]
        standing = inputs["standing"]
        reset = self.resetting and (standing or self.stopped)
        flush = self.state in ("JOG", "ALARM") and self.cancelling and standing
        shown = "HOLD" if self.resetting and self.state in ("IDLE", "RUN", "JOG", "HOME") \
            else self.state
        outputs = {
            "hold": int(self.state not in ("IDLE", "RUN", "JOG", "HOME") or self.resetting
                        or self.cancelling),
            "stop": int(self.stopped or self.emergency_before), "critical": int(self.critical),
            "state": STATES.index(shown) if shown in STATES else None,
            "substate": {"DOOR": 3 if self.renewing else inputs["door"] if standing else 2,
                         "HOLD": 1 - standing}.get(shown),
            "report": int(came == STATUS), "reset": int(reset),
            "flush": int(flush and self.state == "ALARM"),
            "cancelled": int(flush and self.state == "JOG"),
            "enable": int(self.enabled), "fault": 0,
            "alarms_valid": int(self.alarm_line is not None), "alarms_payload": self.alarm_line,
            "messages_valid": int(self.message is not None), "messages_payload": self.message,
        }
        if rst:
            self.__init__()
            return outputs

        if alarms_ready:
            self.alarm_line = None
        if self.message is None or messages_ready:
            self.to_say.sort(key=ORDER.index)
            self.message = self.to_say.pop(0) if self.to_say else None
        was, renewed = self.state, self.renewing
        for message, said in ((RESTORING, inputs["restoring"]), (PROGRAM_END, inputs["ended"]),
                              (RESTORING_SPINDLE, inputs["spindle_restored"] and not renewed)):
            if said:
                self._say(message)
        self._follow(came, bool(reset), bool(flush), inputs)
        opens = came == DOOR or (inputs["door"] and not self.door_before)
        if was == "JOG" or was == "SLEEP":
            if opens:
                self._say(CHECK_DOOR)
        elif self.state == "DOOR" and (was != "DOOR" or opens or renewed > self.renewing):
            self._say(CHECK_DOOR)
        self.door_before = inputs["door"]
        alarm, critical = self._alarm(came, bool(asks_reset), was, inputs)
        if asks_reset:
            self.resetting = True
        if flush:
            self.cancelling = False
        if reset:
            self.state = "START"
            self.resetting = self.stopped = self.critical = False
            self.cancelling = self.door_next = self.renewing = False
        if alarm:
            self.locked, self.door_next, self.renewing = True, False, False
            self.cancelling |= alarm not in (PROBE_INITIAL, PROBE_CONTACT)
            self.state = "START" if reset else "ALARM"
            if was == "HOME" and not critical and alarm != HARD_LIMIT and not reset:
                self.resetting = True
            if self.alarm_line is None:
                self.alarm_line = alarm
        if critical or (asks_reset and inputs["strict"] and not standing
                        and was not in ("START", "ALARM", "SLEEP")):
            self.stopped = True
        if critical or alarm == SOFT_LIMIT:
            self.critical = True
            self._say(RESET_TO_CONTINUE)
        if was in ("RUN", "JOG", "HOME"):
            self.enabled = True
        if was == "SLEEP" or inputs["emergency"]:
            self.enabled = False
        self.limits_before, self.emergency_before = inputs["limits"], inputs["emergency"]
        return outputs

    def _follow(self, came: int | None, reset: bool, flush: bool, inputs: dict[str, int]) -> None:
        """Go to the next state, alarms and resets aside."""
        door = came == DOOR or inputs["door"]
        standing, moving = inputs["standing"], inputs["moving"]
        if self.state == "START":
            self._say(GREETING)
            at_limit = inputs["limits"] and inputs["hard"]
            if at_limit:
                self._say(CHECK_LIMITS)
            if self.locked or at_limit or (self.first and inputs["locked_start"]):
                self._say(LOCKED)
                self.locked = True
            self.state, self.first = "ALARM" if self.locked else "IDLE", False
        elif (self.state in ("IDLE", "RUN", "HOLD") and door) or (
                self.state == "IDLE" and not inputs["restarted"]):
            self.state = "DOOR"
        elif self.state in ("IDLE", "RUN") and (came == HOLD or inputs["pause"]):
            self.state = "HOLD"
        elif self.state == "IDLE":
            for state, wanted in (("SLEEP", inputs["sleep"]), ("HOME", inputs["home"]),
                                  ("CHECK", inputs["check"]),
                                  ("JOG", moving and inputs["jogging"]), ("RUN", moving)):
                if wanted:
                    self.state = state
                    if state in SAYS:
                        self._say(SAYS[state])
                    break
        elif self.state == "RUN" and not moving:
            self.state = "IDLE"
        elif self.state == "JOG":
            self.door_next = bool(self.door_next or door)
            if flush:
                self.state, self.door_next = "DOOR" if self.door_next else "IDLE", False
            elif door or came in (HOLD, JOG_CANCEL):
                self.cancelling = True
            elif not moving and not self.cancelling:
                self.state = "IDLE"
        elif self.state == "HOLD" and came == RESUME and standing:
            self.state = "IDLE"
        elif self.state == "DOOR" and self.renewing:
            if door or inputs["restarted"]:
                self.renewing, self.state = False, "DOOR" if door else "IDLE"
        elif self.state == "DOOR" and came == RESUME and standing and not inputs["door"]:
            self.renewing = True
        elif self.state == "ALARM" and not self.critical and not self.cancelling:
            if inputs["sleep"]:
                self.state = "SLEEP"
                self._say(SLEEPING)
            elif inputs["home"]:
                self.state = "HOME"
            elif inputs["unlock"]:
                self.state, self.locked = "IDLE", False
                self._say(UNLOCKED)
        elif (self.state == "CHECK" and not inputs["check"]) or (
                self.state == "HOME" and not inputs["home"] and not door):
            if self.state == "CHECK":
                self._say(DISABLED)
            else:
                self.locked = False
            self.state = "IDLE"
        elif self.state == "SLEEP":
            self.locked = True

    def _alarm(self, came: int | None, asks_reset: bool, was: str, inputs: dict[str, int]
               ) -> tuple[int, bool]:
        """Return the alarm that begins, 0 for none, and whether it is one that needs a reset."""
        if inputs["emergency"] and (was == "START" or not self.emergency_before):
            return MOTOR_FAULT if inputs["motor_fault"] else EMERGENCY, True
        if was in ("START", "ALARM", "SLEEP"):
            return 0, False
        if inputs["limits"] & ~self.limits_before and inputs["hard"] and was != "HOME":
            return HARD_LIMIT, True
        if asks_reset and inputs["strict"] and not inputs["standing"] and was != "HOME":
            return ABORTED, False
        if inputs["failure"]:
            return inputs["failure"], False
        if was == "HOME" and asks_reset:
            return HOMING_RESET, False
        if was == "HOME" and (came == DOOR or inputs["door"]):
            return HOMING_DOOR, False
        return 0, False

    def _say(self, message: int) -> None:
        if message not in self.to_say:
            self.to_say.append(message)


def control_inputs(rng: random.Random, clocks: int) -> dict[str, list[int]]:
    """Return inputs by name: levels that change now and then, each as often, and pulses."""
    columns: dict[str, list[int]] = {}
    for name in LEVELS:
        rare = name in ("emergency", "door", "check", "home")
        rise, fall = rng.choice([(0.02, 0.1), (0.003, 0.05)]) if rare else (0.08, 0.08)
        columns[name] = _changing(rng, clocks, rise, fall)
    columns["limits"] = [sum(each) for each in zip(*(
        _changing(rng, clocks, 0.005, 0.05, bit) for bit in (1, 2, 4, 8)), strict=True)]
    shares = 0.02, 0.03, 0.1, 0.2, 0.3, 0.3, 0.003, 0.003, 0.003, 0.01, 0.001
    for name, share in zip(PULSES, shares, strict=True):
        columns[name] = [int(rng.random() < share) for _ in range(clocks)]
    codes = RESET, HOLD, RESUME, STATUS, DOOR, JOG_CANCEL, RESUME
    columns["code"] = [rng.choice([*codes, rng.randrange(256)]) for _ in range(clocks)]
    columns["failure"] = [rng.choice([2, 4, 5, 8, 9]) if rng.random() < 0.004 else 0
                          for _ in range(clocks)]
    return columns


def _changing(rng: random.Random, clocks: int, rise: float, fall: float, on: int = 1) -> list[int]:
    """Return a level, by how likely it is that it rises and falls in a clock."""
    level, column = 0, []
    for _ in range(clocks):
        if rng.random() < (fall if level else rise):
            level = on - level
        column.append(level)
    return column
