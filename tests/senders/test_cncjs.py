"""cncjs, a server with a page in the browser, with the gateware: as its page does, by socket.io."""

import json
import math
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.request import Request, urlopen

import numpy as np
import pytest

from tests.senders.machine import Machine, until
from tests.senders.program import program
from tests.senders.session import INCH, Jogs, Overrides, Sender

CLIENT = Path(__file__).with_name("cncjs_client.js")


class Cncjs(Sender):
    """The server, and a client of it.

    Parameters
    ----------
    client : subprocess.Popen
        The client.
    lines : list of str
        What it prints: the events, each a list of JSON.
    machine : Machine
        The machine.
    """

    def __init__(self, client: subprocess.Popen, lines: list[str], machine: Machine) -> None:
        self._client, self._lines, self._machine = client, lines, machine
        self._begun = 0

    def version(self) -> str:
        return subprocess.run(["cncjs", "--version"], capture_output=True, text=True,
                              check=True).stdout.strip()

    def connect(self) -> None:
        begun = len(self._lines)
        self._emit("open", self._machine.port, {"controllerType": "Grbl", "baudrate": 115200})
        self._wait_for("done:open", begun)
        # It asks for settings and modes once it has a greeting or, after 2 s, a report.
        self._wait_for("serialport:read", begun, "$223=500")

    def disconnect(self) -> None:
        begun = len(self._lines)
        self._emit("close", self._machine.port)
        self._wait_for("done:close", begun)

    def check(self) -> None:
        until(lambda: self._last("controller:settings")["settings"].get("$223") == "500", "$$")
        until(lambda: self._last("controller:state")["parserstate"].get("modal"), "$G")
        assert self.setting("$100") == "80.000"
        modal = self._last("controller:state")["parserstate"]["modal"]
        assert (modal["wcs"], modal["plane"], modal["units"]) == ("G54", "G17", "G21")

    def position(self) -> tuple[float, ...]:
        place = self._last("controller:state")["status"]["mpos"]
        return tuple(float(place[axis]) for axis in "xyz")

    def send(self, line: str) -> None:
        self._command("gcode", line)

    def home(self) -> None:
        begun = len(self._lines)
        self._command("homing")
        self._wait_for("serialport:read", begun, "ok")

    def unlock(self) -> None:
        begun = len(self._lines)
        self._command("unlock")
        self._wait_for("serialport:read", begun, "ok")

    def start(self, program: Sequence[str]) -> None:
        begun = len(self._lines)
        self._command("gcode:load", "job", "\n".join(program))
        self._wait_for("gcode:load", begun, "job")
        self._begun = len(self._lines)
        self._command("gcode:start")
        self._wait_for("workflow:state", self._begun, "running")

    def wait(self) -> None:
        self._wait_for("workflow:state", self._begun, "idle")
        ends = [event[1] for event in self._events(self._begun, "sender:status")]
        assert any(end["received"] == end["total"] > 0 for end in ends)

    def hold(self) -> None:
        self._command("gcode:pause")

    def resume(self) -> None:
        self._command("gcode:resume")

    def reset(self) -> None:
        begun = len(self._lines)
        self._command("reset")
        self._wait_for("workflow:state", begun, "idle")
        self._wait_for("serialport:read", begun, "Grbl")

    def setting(self, name: str) -> str:
        """Return a setting, as its page has it."""
        return self._last("controller:settings")["settings"][name]

    def jog(self, words: str) -> None:
        """Jog by a distance."""
        self.send(f"$J=G91 {words} F600")

    def stop_jog(self) -> None:
        """End a jog."""
        self._command("jogCancel")

    def override(self, feed: int, rapid: int, spindle: int) -> None:
        """Change the overrides, by 10 from 100, or to 100."""
        self._command("feedOverride", feed - 100)
        self._command("rapidOverride", rapid)
        self._command("spindleOverride", spindle - 100)

    def probe_grid(self, ends: Sequence[float], step: float, clearance: float, end: float) -> None:
        """Probe at places of a square grid, in X and Y the same."""
        low, high = ends
        self._begun = len(self._lines)
        self._command("autolevel:start", {
            "startX": low, "endX": high, "stepX": step, "startY": low, "endY": high, "stepY": step,
            "clearanceZ": clearance, "startZ": clearance - 1, "endZ": end, "feedrate": 240})

    def leveled(self) -> list[tuple[float, ...]]:
        """Return the places that it has found with the last grid, once it has found all."""
        self._wait_for("autolevel:complete", self._begun)
        return [tuple(event[1]["probedPos"][axis] for axis in "xyz")
                for event in self._events(self._begun, "autolevel:update")]

    def _command(self, *words: object) -> None:
        self._emit("command", self._machine.port, *words)

    def _emit(self, *event: object) -> None:
        assert self._client.stdin
        self._client.stdin.write(json.dumps(event) + "\n")
        self._client.stdin.flush()

    def _events(self, since: int, name: str) -> list[list]:
        return [event for event in map(json.loads, self._lines[since:]) if event[0] == name]

    def _last(self, name: str) -> dict:
        """Return what the last event of a name says of the machine."""
        return self._events(0, name)[-1][2]

    def _wait_for(self, name: str, since: int, begins: str = "") -> None:
        until(lambda: any(not begins or str(event[1]).startswith(begins)
                          for event in self._events(since, name)), f"{name} {begins}")


@pytest.fixture(scope="module")
def sender(machine, tmp_path_factory) -> Iterator[Sender]:
    """It, connected."""
    found = shutil.which("cncjs")
    if found is None:
        pytest.skip("cncjs missing: npm install cncjs, and its node_modules/.bin into PATH")
    folder = tmp_path_factory.mktemp("cncjs")
    with program(found, "-H", "127.0.0.1", "-p", 0, "-c", folder / "cncrc", cwd=folder,
                 env={**os.environ, "HOME": str(folder)}) as (_, lines):
        until(lambda: re.search(r"http://\S+", "".join(lines)), "the address of cncjs")
        address = re.findall(r"http://127\S+", "".join(lines))[0]
        with urlopen(Request(f"{address}/api/signin", b"{}",
                             {"content-type": "application/json"})) as answer:
            token = json.load(answer)["token"]
        with program("node", CLIENT, Path(found).resolve().parent, address, token) as (
                client, lines):
            until(lambda: '["connect"]\n' in lines, "cncjs to accept a client")
            with Cncjs(client, lines, machine) as sender:
                yield sender


class TestCncjs(Jogs, Overrides):
    version = "1.11.5"

    def test_jog_is_ended(self, ready, sender, machine):
        begun = len(machine.received)
        x, *_ = machine.wait_to_be("Idle").position
        sender.jog("X-50")
        machine.wait(lambda: machine.count("error:.*", begun)
                     or machine.reports[-1].state == "Jog", "a jog")
        assert machine.refused(begun) == []
        sender.stop_jog()
        assert x - 50 < machine.wait_to_be("Idle").position[0] < x

    def test_probing(self, ready, sender, machine):
        """It probes a grid by itself, to level what is milled."""
        self._level(sender, machine)

    def test_probing_in_inches(self, ready, sender, machine):
        """Of reports in inches it computes the same grid, and depths in mm, as its page does."""
        self._report(sender, machine, inches=True)
        try:
            until(lambda: sender.setting("$13") == "1", "$13")
            self._level(sender, machine, INCH)
        finally:
            self._report(sender, machine, inches=False)
            until(lambda: sender.setting("$13") == "0", "$13")

    def _level(self, sender, machine, unit: float = 1) -> None:
        """Probe a grid; a unit of reports is so many mm."""
        begun, machine.surface = len(machine.received), -12 / unit
        sender.probe_grid([-30, -10], 20, clearance=-2, end=-30)
        found = machine.wait_for(r"\[PRB:.*:1\]", begun, times=4)
        lines = [line for line in machine.received[begun:found] if line.startswith("[PRB")]
        depths = [unit * float(line.split(",")[2].partition(":")[0]) for line in lines]
        grid = [(-30, -30), (-10, -30), (-30, -10), (-10, -10)]
        wanted = [(*place, depth) for place, depth in zip(grid, depths, strict=True)]
        assert np.allclose(sender.leveled(), wanted, rtol=0, atol=1e-9)
        assert all(-30 < depth <= -12 for depth in depths)
        machine.wait(lambda: machine.reports[-1].position[2] * unit == pytest.approx(
            -2, abs=unit * 1e-4), "the way up")
        machine.surface = -math.inf
        assert machine.refused(begun) == []
