"""Orders to `positioner`, and its messages, as text: no input, no output."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from .arguments import check_whole

__all__ = ["ACK", "ACK_OFF", "AXES", "CONNECT", "DISCONNECT", "DISCONNECTED", "FASTEST", "MEANINGS",
           "ORIGIN", "OVERFLOW", "POINTS", "START_SPEED", "STATE", "STEPS_PER_UM", "ZERO", "Limit",
           "Ok", "Refusal", "State", "Steps", "delimited", "go_to", "jog", "place", "read_line",
           "speed", "stop", "store"]

AXES = ("x", "y", "z")
"""The axes, in the order of the motors 1, 2 and 3."""

POINTS = range(1, 8)
"""Numbers of the points that the machine keeps."""

FASTEST = 1500
"""Highest speed of a motor, in steps/s, unless the machine was built for another."""

START_SPEED = 200
"""Speed of each motor after power-up or reset, in steps/s."""

STEPS_PER_UM = 200 * 90.25 / 318
"""Steps of a motor's turn, times its gear, by the um of a turn of the screw."""

_FARTHEST = 2**31

CONNECT, DISCONNECT, ORIGIN = b"CONNECT\n", b"DISCONNECT\n", b"ORIGIN\n"

ACK, ACK_OFF = b"ACK 1\n", b"ACK 0\n"
"""From here on the machine answers lines that it obeys, or does not, as after power-up."""

STATE = b"STATE\n"
"""Asks for a `State`, with these answers or without them."""

MEANINGS = {
    "COMMAND": "it does not know this command, or the line was disturbed",
    "ARGUMENT": "what follows the command is not what it takes",
    "RANGE": "a number is less or more than it may be",
    "DISCONNECTED": "nothing moves before it is connected",
    "EMPTY": "the point was never stored",
    "LONG": "the line is too long",
    "DAMAGED": "the line was disturbed",
    "OVERFLOW": "more lines came than can be answered; some may have been obeyed",
}
"""What the reasons mean for which it refuses."""


class Steps(NamedTuple):
    """A place, in steps; as a line from the machine, where it is."""

    x: int
    y: int
    z: int


ZERO = Steps(0, 0, 0)


@dataclass(frozen=True)
class Ok:
    """The machine has obeyed a line."""


@dataclass(frozen=True)
class Refusal:
    """The machine did not do what a line requested, for a reason of `MEANINGS` or a new one."""

    reason: str


DISCONNECTED, OVERFLOW = Refusal("DISCONNECTED"), Refusal("OVERFLOW")
"""Refusals by which a reset, and lost answers, are known."""


@dataclass(frozen=True)
class Limit:
    """A limit switch ended the movement of an axis."""

    axis: str


class State(NamedTuple):
    """The answer to `STATE`: what holds of the machine in one moment.

    Attributes
    ----------
    connected : bool
        The motors have power, and it reports.
    moving : tuple of bool
        Whether each motor has a movement, which backlash or a limit switch may hold up.
    speeds : tuple of int
        Speeds of the motors in steps/s.
    switches : tuple of bool
        Whether the switch at each limit input is pressed; which axis it stops is wired elsewhere.
    steps : Steps
        The place.
    seconds : int
        Seconds since power-up or reset.
    """

    connected: bool
    moving: tuple[bool, ...]
    speeds: tuple[int, ...]
    switches: tuple[bool, ...]
    steps: Steps
    seconds: int


def delimited(data: bytes) -> bytes:
    """Return received bytes with line ends around reports, which have none."""
    return data.replace(b"#", b"\n#").replace(b":", b":\n")


def read_line(line: str) -> Steps | Ok | Refusal | State | Limit | None:
    """Read a line from the machine; None for one that it does not send, such as half of one."""
    if report := _REPORT.fullmatch(line):
        return _steps(report.groups())
    if line == "ok":
        return Ok()
    if state := _STATE.fullmatch(line):
        connected, *numbers = map(int, state.groups())
        steps, seconds = _steps(numbers[9:12]), numbers[12]
        if steps is None or seconds >= _FARTHEST:
            return None
        return State(bool(connected), tuple(map(bool, numbers[:3])), tuple(numbers[3:6]),
                     tuple(map(bool, numbers[6:9])), steps, seconds)
    if limit := re.fullmatch(r"! LIMIT MOT([123])", line):
        return Limit(AXES[int(limit[1]) - 1])
    if refusal := re.fullmatch(r"! (?!LIMIT)([A-Z][A-Z ]{0,40})", line):
        return Refusal(refusal[1])
    return None


_REPORT = re.compile("# POS" + r" (-?\d{1,10})" * 3 + " :", re.ASCII)
_STATE = re.compile("STATE" + " ([01])" * 4 + r" (\d{1,10})" * 3 + " ([01])" * 3
                    + r" (-?\d{1,10})" * 3 + r" (\d{1,10})", re.ASCII)


def _steps(numbers: Iterable[str | int]) -> Steps | None:
    steps = Steps(*map(int, numbers))
    return steps if all(map(_fits, steps)) else None


def jog(axis: str, direction: int) -> bytes:
    """Move an axis up (1) or down (-1), without end."""
    if direction not in (1, -1):
        raise ValueError(f"direction must be 1 or -1, not {direction!r}")
    return f"MOV {_motor(axis)} {'C' if direction > 0 else 'CC'}\n".encode()


def stop(axes: Iterable[str] = AXES) -> bytes:
    """End the movement of axes."""
    return b"".join(f"STOP {_motor(axis)}\n".encode() for axis in axes)


def speed(axis: str, steps_per_second: int, fastest: int = FASTEST) -> bytes:
    """Set the speed of an axis."""
    if not 1 <= steps_per_second <= fastest:
        raise ValueError(f"speed must be 1 to {fastest} steps/s, not {steps_per_second}")
    return f"VEL {_motor(axis)} {steps_per_second:d}\n".encode()


def store(point: int, steps: Steps) -> bytes:
    """Let the machine keep a point."""
    return f"P {_point(point)} {_numbers(steps)}\n".encode()


def go_to(point: int) -> bytes:
    """Go to a point that was stored."""
    return f"GOTO {_point(point)}\n".encode()


def place(steps: Steps) -> bytes:
    """Set the machine's place."""
    return f"POS {_numbers(steps)}\n".encode()


def _motor(axis: str) -> str:
    if axis not in AXES:
        raise ValueError(f"axis must be x, y or z, not {axis!r}")
    return f"MOT{AXES.index(axis) + 1}"


def _point(point: int) -> int:
    return check_whole("point", point, POINTS[0], POINTS[-1])


def _numbers(steps: Steps) -> str:
    for axis, number in zip(AXES, steps, strict=True):
        if not _fits(number):
            raise ValueError(f"{axis} is out of the machine's reach: {number} steps")
    return " ".join(f"{number:d}" for number in steps)


def _fits(number: int) -> bool:
    return -_FARTHEST <= number < _FARTHEST
