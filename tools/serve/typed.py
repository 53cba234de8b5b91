"""What is typed while a machine runs in simulation: limit switches, and breaks of its line."""

import asyncio
import os
import select

from ..console import UserError, say, warn
from .service import Service
from .switches import Switches

__all__ = ["Typed"]

#: Seconds from one look whether something was typed to the next.
LOOK = 0.1

#: Most bytes of a line.
LONGEST = 256


class Typed:
    """Does what is typed, a line each: ``limit x on``, ``limit x off``, ``break``.

    Parameters
    ----------
    service : Service
        The machine.
    switches : Switches
        Its limit switches, if it has any.
    """

    def __init__(self, service: Service, switches: Switches) -> None:
        self._service, self._switches = service, switches

    async def listen(self, file: int) -> None:
        """Do what comes from a file descriptor, until there is no more.

        What is typed for another program, while this one is in the background, is left to that.
        """
        rest = b""
        while True:
            await asyncio.sleep(LOOK)
            if not select.select([file], [], [], 0)[0] or not _ours(file):
                continue
            try:
                data = os.read(file, LONGEST)
            except OSError:  # the terminal is gone
                return
            if not data:
                return
            *lines, rest = (rest + data).split(b"\n")
            rest = rest[:LONGEST]
            for line in lines:
                self.obey(line.decode("utf-8", "replace"))

    def obey(self, line: str) -> None:
        """Do what a line asks for, and say so; warn of one that is not understood."""
        try:
            match line.lower().split():
                case []:
                    pass
                case ["limit", name, ("on" | "off") as state] if self._switches.ends:
                    end = self._switches.press(name, state == "on")
                    say(f"limit switch {end} {'pressed' if state == 'on' else 'released'}")
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
        return ", ".join([f"limit {axis} {state}" for axis in first for state in ("on", "off")]
                         + ["break"]).replace(", break", ", or break")


def _ours(file: int) -> bool:
    """Say whether what is typed there is for this program."""
    try:
        return os.tcgetpgrp(file) == os.getpgrp()
    except OSError:  # no terminal, or not the one that this program runs in
        return True
