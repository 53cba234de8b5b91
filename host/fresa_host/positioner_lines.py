"""Orders to `positioner`, and its messages, as text: no input, no output."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from .arguments import check_whole

__all__ = ["AXES", "FASTEST", "MEANINGS", "POINTS", "STEPS_PER_UM", "Limit", "Refusal", "Steps",
           "go_to", "jog", "place", "read_line", "speed", "stop", "store"]

AXES = ("x", "y", "z")
"""The axes, in the order of the motors 1, 2 and 3."""

POINTS = range(1, 8)
"""Numbers of the points that the machine keeps."""

FASTEST = 1500
"""Highest speed of a motor, in steps/s, unless the machine was built for another."""

STEPS_PER_UM = 200 * 90.25 / 318
"""Steps of a motor's turn, times its gear, by the um of a turn of the screw."""

_FARTHEST = 2**31

MEANINGS = {
    "COMMAND": "it does not know this command, or the line was disturbed",
    "ARGUMENT": "what follows the command is not what it takes",
    "RANGE": "a number is less or more than it may be",
    "DISCONNECTED": "nothing moves before it is connected",
    "EMPTY": "the point was never stored",
    "LONG": "the line is too long",
    "DAMAGED": "the line was disturbed",
    "OVERFLOW": "more lines were refused than can be answered one by one",
}
"""What the reasons mean for which it refuses."""


class Steps(NamedTuple):
    """A place, in steps; as a line from the machine, where it is."""

    x: int
    y: int
    z: int


@dataclass(frozen=True)
class Refusal:
    """The machine did not do what a line requested, for a reason of `MEANINGS` or a new one."""

    reason: str


@dataclass(frozen=True)
class Limit:
    """A limit switch ended the movement of an axis."""

    axis: str


def read_line(line: str) -> Steps | Refusal | Limit | None:
    """Read a line from the machine; None for one that it does not send, such as half of one."""
    if report := re.fullmatch(r"# POS (-?\d{1,10}) (-?\d{1,10}) (-?\d{1,10}) :", line, re.ASCII):
        steps = Steps(*map(int, report.groups()))
        return steps if all(map(_fits, steps)) else None
    if limit := re.fullmatch(r"! LIMIT MOT([123])", line):
        return Limit(AXES[int(limit[1]) - 1])
    if refusal := re.fullmatch(r"! ([A-Z][A-Z ]{0,40})", line):
        return Refusal(refusal[1])
    return None


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
