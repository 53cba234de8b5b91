"""bCNC, a program with windows, with the gateware: by the pages that it serves for a telephone."""

import json
import math
import shutil
import socket
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import urlencode
from urllib.request import urlopen

import pytest

from tests.senders.machine import Machine, until
from tests.senders.program import program
from tests.senders.session import Jogs, Overrides, Sender

SETTINGS = """\
[Connection]
port = {port}
baud = 115200
controller = GRBL1
openserial = 0
pendant = 1
pendantport = {tcp}
"""


class BCNC(Sender):
    """The program, in a screen without a monitor.

    Parameters
    ----------
    address : str
        Of the pages that it serves.
    folder : pathlib.Path
        For programs.
    machine : Machine
        The machine.
    """

    def __init__(self, address: str, folder: Path, machine: Machine) -> None:
        self._address, self._folder, self._machine = address, folder, machine
        self._begun = 0

    def version(self) -> str:
        packaged = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "bcnc"],
                                  capture_output=True, text=True, check=True).stdout
        return packaged.partition("+")[0]

    def connect(self) -> None:
        self._command("OPEN")
        until(lambda: self._state()["state"] in ("Idle", "Alarm"), "a connection")

    def disconnect(self) -> None:
        self._command("OPEN")
        until(lambda: self._state()["state"] == "Not connected", "the end of the connection")

    def check(self) -> None:
        begun = len(self._machine.received)
        self._command("$G")
        until(lambda: {"G54", "G17", "G21"} < {*self._state()["G"]}, "the answer to $G")
        self._command("$$")
        self._machine.wait_for(r"\$223=500", begun)
        self._command("$I")
        self._machine.wait_for(r"\[OPT:.*", begun)

    def position(self) -> tuple[float, ...]:
        state = self._state()
        return tuple(state[f"m{axis}"] for axis in "xyz")

    def send(self, line: str) -> None:
        self._command(line)  # it evaluates what is in brackets

    def home(self) -> None:
        begun = len(self._machine.received)
        self._command("HOME")
        self._machine.wait_for("ok", begun)

    def unlock(self) -> None:
        self._command("UNLOCK")
        self._machine.wait_to_be("Idle")

    def start(self, program: Sequence[str]) -> None:
        path = self._folder / "job.ngc"
        path.write_text("".join(f"{line}\n" for line in program))
        self._command(f"LOAD {path}")
        self._begun = len(self._machine.received)
        self._command("RUN")

    def wait(self) -> None:
        self._purged(1)

    def hold(self) -> None:
        self._command("FEEDHOLD")

    def resume(self) -> None:
        self._command("RESUME")

    def reset(self) -> None:
        self._command("STOP")  # holds, resets, and unlocks
        self._purged(2)

    def jog(self, words: str) -> None:
        """Jog by a distance, as its arrows do."""
        self._command(f"$J=G91 {words} F100000")

    def override(self, feed: int, rapid: int, spindle: int) -> None:
        """Set what its scales set."""
        names = "_OvFeed, _OvRapid, _OvSpindle, _OvChanged"
        self._command(f"%global {names}; {names} = {feed}, {rapid}, {spindle}, True")

    def _purged(self, resets: int) -> None:
        """Wait until it has reset the machine, as it does after each job, and asks again."""
        reset = self._machine.wait_for("Grbl .*", self._begun, resets)
        self._machine.wait_for("<.*", reset, times=4)

    def _command(self, line: str) -> None:
        with urlopen(f"{self._address}/send?{urlencode({'cmd': line})}") as answer:
            assert answer.status == 200

    def _state(self) -> dict:
        with urlopen(f"{self._address}/state") as answer:
            return json.load(answer)


def free_port() -> int:
    """Return a TCP port that is free."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@pytest.fixture(scope="module")
def sender(machine, tmp_path_factory) -> Iterator[Sender]:
    """It, connected."""
    if not (shutil.which("bCNC") and shutil.which("Xvfb")):
        pytest.skip("bCNC or Xvfb missing: apt install bcnc xvfb")
    folder, tcp = tmp_path_factory.mktemp("bcnc"), free_port()
    (folder / ".bCNC").write_text(SETTINGS.format(port=machine.port, tcp=tcp))
    with program("Xvfb", "-displayfd", 1, "-screen", 0, "1280x1024x24", "-nolisten", "tcp") as (
            _, lines):
        until(lambda: lines, "a screen")
        # With the system's Python, which has its Tk.
        environment = {"HOME": str(folder), "PATH": "/usr/bin:/bin",
                       "DISPLAY": f":{lines[0].strip()}"}
        with program("bCNC", cwd=folder, env=environment):
            until(lambda: answers(tcp), "the pages of bCNC")
            with BCNC(f"http://127.0.0.1:{tcp}", folder, machine) as sender:
                yield sender


def answers(tcp: int) -> bool:
    """Return whether a TCP port accepts connections."""
    with socket.socket() as tried:
        return not tried.connect_ex(("127.0.0.1", tcp))


class TestBCNC(Jogs, Overrides):
    version = "0.9.14.318"

    def test_probing(self, ready, sender, machine):
        """It computes with the place where the probe has touched."""
        begun, machine.surface = len(machine.received), -12
        sender.send("G90 G0 X-20 Y-25 Z-11")
        sender.send("G38.2 Z-40 F120")
        touched = machine.wait_for(r"\[PRB:.*:1\]", begun)
        x, y, z = map(float, machine.received[touched - 1][5:-3].split(","))
        assert (x, y) == (-20, -25)
        assert -40 < z <= machine.surface
        sender.send("G53 G0 X[prbx-1] Y[prby+2] Z[prbz+5]")
        machine.wait(lambda: machine.reports[-1].position == pytest.approx(
            (x - 1, y + 2, z + 5), abs=2e-3), "the place beside")
        machine.surface = -math.inf
        # It asks for $# by itself, also while the machine moves: as GRBL does, that is refused.
        assert set(machine.refused(begun)) <= {"error:8"}
