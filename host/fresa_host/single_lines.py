"""What `single` is told and what it says, without a line between: no input, no output."""

import re

from .errors import Refused

__all__ = ["FASTEST", "GREETING", "HIGHEST", "Reply", "frame"]

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


def frame(command: str, value: int | str = "") -> bytes:
    """Return the frame of a command (``x``, ``v``, ``e`` or ``d``) and what belongs to it.

    Raises
    ------
    ValueError
        If a number may not be.
    """
    highest = {"x": HIGHEST, "v": FASTEST, "e": 1}.get(command)
    if isinstance(value, int) and highest is not None:
        lowest = int(command == "v")
        if not lowest <= value <= highest:
            raise ValueError(f"{command} takes {lowest} to {highest}, not {value}")
    return f":{command}{value}\r".encode()


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
        """Give the number behind ``x:`` or ``v:``, the last if there are several; None if none."""
        for line in reversed(self.lines):
            if found := re.fullmatch(rf"{name}:(\d{{1,5}})", line, re.ASCII):
                return int(found[1])
        return None
