"""Lines of the GRBL 1.1 protocol, both ways, as text: no input, no output."""

import re
from collections.abc import Iterable
from typing import NamedTuple

from .errors import MachineError, Refused

__all__ = ["BAUD", "BUFFER", "GREETING", "HOLD", "JOG_CANCEL", "RESET", "RESUME", "STATUS",
           "Alarmed", "BlockRefused", "Message", "Position", "Status", "block", "decode", "program"]

BAUD = 115_200
"""Bits a second of the line, unless it was built with others."""

BUFFER = 127
"""Most bytes of lines that wait for their answers: GRBL's receive buffer has one place more."""

STATUS, HOLD, RESUME, RESET, JOG_CANCEL = b"?", b"!", b"~", b"\x18", b"\x85"
"""Real-time commands: they are outside of lines and not answered."""

GREETING = re.compile(r"Grbl (\S{1,20})(?: .*)?", re.ASCII)

_NUMBER = r"-?\d{1,9}(?:\.\d{0,9})?"

ERRORS = {
    1: "a word does not begin with a letter",
    2: "a letter has no number, or a bad one",
    3: "there is no such $ command",
    4: "the number may not be negative",
    5: "homing is switched off in the settings",
    6: "the step pulse is too short",
    7: "the settings could not be read, and are the defaults now",
    8: "that needs a machine that is idle",
    9: "it is locked by an alarm, or jogs",
    10: "soft limits need homing, which is off",
    11: "the line is too long, or was damaged on its way",
    12: "the setting makes steps faster than it can",
    13: "the door is open",
    14: "the line is too long to be stored",
    15: "the jog would leave the machine's travel",
    16: "a jog needs axes, and has no other commands",
    17: "laser mode needs a spindle with PWM",
    20: "there is no such command",
    21: "two commands of the line exclude each other",
    22: "there is no feed: F is missing",
    23: "the command takes a whole number",
    24: "two commands of the line would use the axes",
    25: "a letter is there twice",
    26: "the command needs an axis",
    27: "the line number is too large",
    28: "the command needs P or L",
    29: "there is no such coordinate system: P is 0 to 6",
    30: "G53 goes with G0 and G1 only",
    31: "no command of the line uses its axes",
    32: "an arc needs an axis of its plane",
    33: "the target cannot be: the arc's radii differ, say, or it is out of reach",
    34: "the arc's radius is too small for its ends",
    35: "an arc needs an offset of its plane: I, J or K",
    36: "there are words that no command uses",
    37: "G43.1 takes Z alone",
    38: "the number is too large",
}
"""What GRBL's error codes mean."""

ALARMS = {
    0: "it is locked: home, or unlock it",
    1: "a limit switch was hit; the position may be wrong: home again",
    2: "the target is beyond the travel; the position is right",
    3: "it was reset while moving; the position may be wrong: home again",
    4: "the probe was in its final state at the start",
    5: "the probe did not touch",
    6: "homing was ended by a reset",
    7: "homing was ended by the door",
    8: "homing did not leave a limit switch",
    9: "homing did not find a limit switch",
    10: "the emergency stop was pressed; the position may be wrong: home again",
    17: "a motor driver reported a fault; the position may be wrong: home again",
}
"""What alarm codes mean: those of GRBL, and two for inputs that it has not."""


class BlockRefused(Refused):
    """The machine refused a line.

    Attributes
    ----------
    code : int
        GRBL's error code.
    line : int or None
        Which of a program, counted from 1.
    text : str
        What was sent.
    """

    def __init__(self, code: int, text: str, line: int | None = None) -> None:
        where = "" if line is None else f"line {line}: "
        meaning = ERRORS.get(code, "it does not say more")
        super().__init__(f"error:{code}", f"{where}{meaning}, in {text!r}")
        self.code, self.text, self.line = code, text, line


class Alarmed(MachineError):
    """The machine raised an alarm, and takes no movement until it is homed or unlocked.

    Attributes
    ----------
    code : int
        GRBL's alarm code.
    """

    def __init__(self, code: int) -> None:
        super().__init__(f"ALARM:{code}: {ALARMS.get(code, 'it does not say more')}")
        self.code = code


class Position(NamedTuple):
    """A position in mm, or in inches if the machine reports in them ($13)."""

    x: float
    y: float
    z: float

    def __str__(self) -> str:
        return f"X{self.x:.3f} Y{self.y:.3f} Z{self.z:.3f}"


class Status(NamedTuple):
    """A status report.

    Attributes
    ----------
    state : str
        ``Idle``, ``Run``, ``Hold``, ``Jog``, ``Alarm``, ``Door``, ``Check``, ``Home`` or ``Sleep``.
    substate : int
        Behind ``Hold`` and ``Door``: 0 if it stands.
    machine, work, offset : Position or None
        Position in the machine's and in work coordinates, and the origin of these; one of the
        first two is in every report.
    feed, speed : float or None
        In mm/min, or inches/min if the machine reports in them ($13), and rev/min.
    pins : str
        Inputs that are active, such as ``XP``.
    planner, buffer : int or None
        Blocks and bytes that there is room for.
    overrides : tuple of int or None
        Of feed, rapids and spindle in percent.
    """

    state: str
    substate: int = 0
    machine: Position | None = None
    work: Position | None = None
    offset: Position | None = None
    feed: float | None = None
    speed: float | None = None
    pins: str = ""
    planner: int | None = None
    buffer: int | None = None
    overrides: tuple[int, int, int] | None = None

    @classmethod
    def decode(cls, line: str) -> "Status | None":
        """Return what a line ``<...>`` says, or None if it is no report, or damaged."""
        if not (found := re.fullmatch(r"<([A-Z][a-z]{2,5})(?::(\d))?((?:\|[^|<>]+)*)>", line,
                                      re.ASCII)):
            return None
        status = cls(found[1], int(found[2] or 0))
        for field in found[3].split("|")[1:]:
            name, _, text = field.partition(":")
            if name == "Pn":
                status = status._replace(pins=text)
            if (kind := _FIELDS.get(name)) is None:
                continue
            if not re.fullmatch(rf"{_NUMBER}(?:,{_NUMBER}){{{kind[0] - 1}}}", text, re.ASCII):
                return None
            status = status._replace(**kind[1]([float(number) for number in text.split(",")]))
        return None if status.machine is None and status.work is None else status


_FIELDS = {  # how many numbers, and what they are
    "MPos": (3, lambda n: {"machine": Position(*n)}), "WPos": (3, lambda n: {"work": Position(*n)}),
    "WCO": (3, lambda n: {"offset": Position(*n)}), "F": (1, lambda n: {"feed": n[0]}),
    "FS": (2, lambda n: {"feed": n[0], "speed": n[1]}),
    "Bf": (2, lambda n: {"planner": int(n[0]), "buffer": int(n[1])}),
    "Ov": (3, lambda n: {"overrides": tuple(map(int, n))}),
}


class Message(NamedTuple):
    """A line of the machine.

    Attributes
    ----------
    kind : str
        ``ok``, ``error``, ``alarm``, ``greeting`` or ``text``, such as ``[MSG:...]``.
    text : str
        The whole line.
    code : int
        Of an error or alarm.
    """

    kind: str
    text: str
    code: int = 0


def decode(line: str) -> Message | Status | None:
    """Return what a line of the machine says; None for a status report that is damaged."""
    if line == "ok":
        return Message("ok", line)
    if found := re.fullmatch(r"(error|ALARM):(\d{1,3})", line, re.ASCII):
        return Message(found[1].lower(), line, int(found[2]))
    if GREETING.fullmatch(line):
        return Message("greeting", line)
    return Status.decode(line) if line.startswith("<") else Message("text", line)


def block(line: str) -> str:
    """Return a line as it is sent: without comments, end, and space around it.

    Raises
    ------
    ValueError
        If it has more than `BUFFER` bytes with its end, or characters that are no part of a line:
        ``?``, ``!``, ``~``, control characters, and what is not ASCII.
    """
    text = re.sub(r"\([^)]*(?:\)|$)|;.*", "", line.strip("\r\n")).replace("\t", " ").strip(" ")
    if bad := re.search(r"[^ -}]|[?!]", text):
        raise ValueError(f"{bad[0]!r} may not be in a line: {text[:BUFFER]!r}")
    if len(text) >= BUFFER:
        raise ValueError(f"a line has at most {BUFFER - 1} characters: {text[:BUFFER]!r}...")
    return "" if text == "%" else text


def program(lines: Iterable[str]) -> list[tuple[int, str]]:
    """Return the lines to send, each with its number, counted from 1; empty ones are left out.

    Raises
    ------
    ValueError
        If one cannot be sent; the text names it.
    """
    blocks = []
    for number, line in enumerate(lines, 1):
        try:
            text = block(line)
        except ValueError as error:
            raise ValueError(f"line {number}: {error}") from None
        if text:
            blocks.append((number, text))
    return blocks
