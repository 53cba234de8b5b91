"""Frames to `single`, and its answers, as text: no input, no output."""

import re
from typing import NamedTuple

from .arguments import check_whole
from .errors import Refused

__all__ = ["FASTEST", "GREETING", "HIGHEST", "Reply", "frame", "question"]

HIGHEST = 9999
"""Highest set-point, in steps."""

FASTEST = 59_999
"""Highest speed, in rpm of full steps."""

GREETING = "fresa single"
"""Line that it sends after a reset, before its help."""

MEANINGS = {
    "command": "it does not know this command, or the line was disturbed",
    "number": "there is no number where one is due",
    "range": "the number may not be",
    "length": "the command is too long",
}

#: Most lines of one answer; help has some ten.
MOST_LINES = 64


class _Value(NamedTuple):
    """What a command takes: its name for people, and its range."""

    name: str
    least: int
    most: int


_VALUES = {"x": _Value("position in steps", 0, HIGHEST), "v": _Value("speed in rpm", 1, FASTEST),
           "e": _Value("power", 0, 1)}

def frame(command: str, value: object = None) -> bytes:
    """Return the frame of a command: ``x``, ``v`` or ``e`` with a number, or ``d``.

    Raises
    ------
    ValueError
        If the number is not whole, or out of range.
    """
    if command in _VALUES:
        what = _VALUES[command]
        value = check_whole(what.name, value, what.least, what.most)
    return f":{command}{'' if value is None else value}\r".encode()


def question(command: str) -> bytes:
    """Return the frame that asks for the position (``x``) or the speed (``v``)."""
    return f":{command}?\r".encode()


class Reply:
    """Gathers the lines of one answer.

    Attributes
    ----------
    lines : list of str
        Those before the last.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, line: str) -> bool:
        """Take a line; say whether it is the last.

        Raises
        ------
        Refused
            If it says that the frame was not obeyed.
        """
        if line == "ok":
            return True
        if refused := re.fullmatch(r"err (\w+)", line):
            reason = refused[1]
            raise Refused(reason, MEANINGS.get(reason, "it does not say more"))
        if len(self.lines) < MOST_LINES:
            self.lines.append(line)
        return False

    def number(self, name: str) -> int | None:
        """Return the number behind the last ``x:`` or ``v:``; None if there is none."""
        for line in reversed(self.lines):
            if found := re.fullmatch(rf"{name}:(\d{{1,5}})", line, re.ASCII):
                return int(found[1])
        return None
