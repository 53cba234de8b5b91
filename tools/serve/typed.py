"""Typed commands while a simulated machine runs: its switches, and breaks of its line."""

import asyncio
import os
import select
from collections.abc import Sequence

from ..console import UserError, say, warn
from .service import Service
from .switches import Switches

__all__ = ["Typed"]

#: Seconds between checks of the input.
POLL_S = 0.1

#: Most bytes of a line.
LONGEST_LINE = 256


class Typed:
    """Executes typed commands, one per line: ``limit x on``, ``door off``, ``break``.

    Parameters
    ----------
    service : Service
        The machine.
    switches : Switches
        Its limit switches, if it has any.
    contacts : sequence of str
        Names of its other inputs that can be switched.
    """

    def __init__(self, service: Service, switches: Switches,
                 contacts: Sequence[str] = ()) -> None:
        self._service, self._switches, self._contacts = service, switches, contacts

    async def listen(self, file: int) -> None:
        """Execute commands from a file descriptor, until its end.

        Input is left to the program in the foreground while this one is in the background.
        """
        rest = b""
        while True:
            await asyncio.sleep(POLL_S)
            if not select.select([file], [], [], 0)[0] or not _ours(file):
                continue
            try:
                data = os.read(file, LONGEST_LINE)
            except OSError:  # the terminal is closed
                return
            if not data:
                return
            *lines, rest = (rest + data).split(b"\n")
            rest = rest[:LONGEST_LINE]
            for line in lines:
                self.execute(line.decode("utf-8", "replace"))

    def execute(self, line: str) -> None:
        """Execute a command, and report it; warn of an unknown one."""
        try:
            match line.lower().split():
                case []:
                    pass
                case ["limit", name, ("on" | "off") as state] if self._switches.ends:
                    end = self._switches.press(name, state == "on")
                    say(f"limit switch {end} {'pressed' if state == 'on' else 'released'}")
                case [name, ("on" | "off") as state] if name in self._contacts:
                    self._service.set(**{name: int(state == "on")})
                    say(f"{name} {state}")
                case ["break"]:
                    self._service.send_break()
                    say("a break was sent")
                case _:
                    raise UserError(f"not understood: {line.strip()[:40]!r}; type {self._words}")
        except UserError as error:
            warn(str(error))

    @property
    def _words(self) -> str:
        first = [end[0].lower() for end in self._switches.ends[:1]]
        of_contacts = [f"{' or '.join(self._contacts)} and on or off"] if self._contacts else []
        return ", ".join([f"limit {axis} {state}" for axis in first for state in ("on", "off")]
                         + of_contacts + ["break"]).replace(", break", ", or break")


def _ours(file: int) -> bool:
    """Return whether this program is in the foreground of its terminal."""
    try:
        return os.tcgetpgrp(file) == os.getpgrp()
    except OSError:  # not a terminal, or another program's
        return True
