"""A machine of G-code that is served, and what it sends to all that are connected."""

import math
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from tests.tools.process import PATIENCE, Command, running

__all__ = ["HOME", "LIMIT_S", "Machine", "Report", "serve", "until"]

AXES = "xyz"
PULL_OFF = 10
HOME = (-PULL_OFF,) * 3
"""Where the axes are after homing."""

#: Switches are pressed by what reports say. An axis takes 2.5 s for the way from its switch, so
#: that a report, and the press for it, may come as late on a busy computer.
SETTINGS = f"21=0,22=1,24=240,25=240,27={PULL_OFF}"
OPTIONS = ("--steps", 80, 80, 400, "--rate", 6000, 6000, 1200, "--acceleration", 500, 500, 100,
           "--settings", SETTINGS)

LIMIT_S = 600
"""Seconds for anything: on a busy computer the machine is much slower than a real one."""

#: Seconds between looks for something to happen.
POLL_S = 0.1


def until(seen: Callable[[], object], what: str) -> None:
    """Wait until something is seen."""
    end = time.monotonic() + LIMIT_S
    while not seen():
        assert time.monotonic() < end, f"this did not come: {what}"
        time.sleep(POLL_S)


class Report(NamedTuple):
    """An answer to ``?``: state, position of the machine, and the other fields by their names."""

    state: str
    position: tuple[float, ...]
    fields: dict[str, str]


class Machine:
    """A machine that is served: all that it sends while it is asked.

    Each axis has a limit switch at its place 0, and is on it at power-up.

    Attributes
    ----------
    port : str
        Path of its pseudo-terminal.
    received : list of str
        The lines that it has sent.
    reports : list of Report
        Those of them that are reports.
    ask : callable
        Called while something is waited for: makes a sender ask that does not do so by itself.
    surface : float
        Where the probe touches: it is switched on by the first report from there or below, and off
        by the first from above.
    """

    def __init__(self, command: Command, port: str, line: socket.socket) -> None:
        self.port = port
        self.received: list[str] = []
        self.reports: list[Report] = []
        self.ask: Callable[[], object] = lambda: None
        self.surface = -math.inf
        self._command, self._line = command, line
        self._pressed = [False] * len(AXES)
        self._touches = False
        self._listener = threading.Thread(target=self._listen)
        self._listener.start()

    def wait(self, seen: Callable[[], object], what: str) -> None:
        """Wait until something is seen of what it sends."""
        try:
            until(lambda: self.ask() or seen(), what)
        except AssertionError as error:
            error.add_note(f"the last that was received: {self.received[-20:]}")
            raise

    def found(self, pattern: str, since: int) -> list[str]:
        """Return the lines from `since` on that are of a pattern, as a whole."""
        return [line for line in self.received[since:] if re.fullmatch(pattern, line)]

    def count(self, pattern: str, since: int) -> int:
        """Return how many these are."""
        return len(self.found(pattern, since))

    def refused(self, since: int) -> list[str]:
        """Return the errors and alarms from `since` on."""
        return self.found(r"error:.*|ALARM:.*", since)

    def wait_for(self, pattern: str, since: int, times: int = 1) -> int:
        """Wait for lines of a pattern, from `since` on; return the number of the next line."""
        self.wait(lambda: self.count(pattern, since) >= times, pattern)
        found = [number for number, line in enumerate(self.received) if re.fullmatch(pattern, line)
                 and number >= since]
        return found[times - 1] + 1

    def wait_to_be(self, state: str) -> Report:
        """Wait for a later report of a state; return it."""
        begun = len(self.reports)
        self.wait(lambda: self._since(begun, state), state)
        return self._since(begun, state)[0]

    def end(self) -> None:
        """Listen no longer."""
        self._line.shutdown(socket.SHUT_RDWR)
        self._listener.join(PATIENCE)
        self._line.close()

    def _since(self, begun: int, state: str) -> list[Report]:
        return [report for report in self.reports[begun:] if report.state == state]

    def _listen(self) -> None:
        rest = b""
        while data := self._line.recv(1024):
            *lines, rest = (rest + data).split(b"\r\n")
            for line in lines:
                self._take(line.decode("ascii"))

    def _take(self, line: str) -> None:
        self.received.append(line)
        if line.startswith("<"):
            state, position, *fields = line.strip("<>").split("|")
            place = tuple(map(float, position.removeprefix("MPos:").split(",")))
            self.reports.append(Report(state.partition(":")[0], place,
                                       dict(field.split(":") for field in fields)))
            for axis, at in enumerate(place):
                if self._pressed[axis] != (at >= 0):
                    self._pressed[axis] = at >= 0
                    self._command.type(f"limit {AXES[axis]} {'on' if at >= 0 else 'off'}")
            if self._touches != (place[2] <= self.surface):
                self._touches = not self._touches
                self._command.type(f"probe {'on' if self._touches else 'off'}")


@contextmanager
def serve(*options: object) -> Iterator[Machine]:
    """Serve a machine that is at its switches, and has to be homed, with further options."""
    with running("tools.serve", "gcode", *OPTIONS, *options, "--tcp", 0) as command:
        port = command.first(r"/dev/\S+")
        host, tcp = command.first(r"(?<=socket://)\S+").split(":")
        machine = Machine(command, port, socket.create_connection((host, int(tcp))))
        try:
            yield machine
        finally:
            machine.end()
