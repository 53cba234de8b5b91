"""grbl-streamer, a library for Python, with the gateware."""

from collections.abc import Iterator, Sequence
from importlib.metadata import version

import pytest

from tests.senders.machine import Machine, until
from tests.senders.session import Probes, Sender


class GrblStreamer(Sender):
    """Its class of this name."""

    def __init__(self, library, machine: Machine) -> None:
        self._machine = machine
        self._events: list[tuple] = []
        self.streamer = library.GrblStreamer(lambda *event: self._events.append(event))

    def version(self) -> str:
        return version("grbl-streamer")

    def connect(self) -> None:
        begun = len(self._events)
        self.streamer.cnect(self._machine.port)
        self._greeted(begun)
        self.streamer.poll_start()
        self._answered(begun)

    def disconnect(self) -> None:
        self.streamer.disconnect()

    def check(self) -> None:
        assert self.streamer.is_connected()
        assert self.streamer.settings_hash["G54"] == (0, 0, 0)
        assert self.streamer.settings_hash["TLO"] == (0,)
        assert self._event("on_read", 0, "$100=80.000")

    def position(self) -> tuple[float, ...]:
        return self.streamer.cmpos

    def send(self, line: str) -> None:
        self.streamer.send_immediately(line)

    def home(self) -> None:
        begun = len(self._machine.received)
        self.streamer.homing()
        self._machine.wait_for("ok", begun)

    def unlock(self) -> None:
        begun = len(self._machine.received)
        self.streamer.killalarm()
        self._machine.wait_for("ok", begun)
        until(lambda: self.streamer.cmode == "Idle", "Idle")

    def start(self, program: Sequence[str]) -> None:
        self.streamer.job_new()
        self.streamer.write("\n".join(program))
        self.streamer.job_run()

    def wait(self) -> None:
        until(lambda: self.streamer.job_finished, "the end of the job")
        self._machine.wait_to_be("Idle")

    def hold(self) -> None:
        self.streamer.hold()

    def resume(self) -> None:
        self.streamer.resume()

    def reset(self) -> None:
        begun = len(self._events)
        self.streamer.job_halt()  # it would send lines behind the reset until it is greeted
        self.streamer.softreset()
        self._greeted(begun)
        self._answered(begun)

    def probe(self, line: str) -> None:
        """Probe."""
        self._events.clear()
        self.streamer.send_immediately(line)

    def probed(self) -> tuple[float, ...] | None:
        """Return where the probe has touched, as it has told its user."""
        return next((values[0] for event, *values in self._events if event == "on_probe"), None)

    def _greeted(self, since: int) -> None:
        self._machine.wait(lambda: self._event("on_boot", since), "a greeting")

    def _answered(self, since: int) -> None:
        """Wait for what it asks for when it is greeted."""
        self._machine.wait(lambda: self._event("on_hash_stateupdate", since)
                           and self._event("on_read", since, "[GC:"), "answers to $# and $G")

    def _event(self, name: str, since: int, begins: str = "") -> bool:
        return any(event == name and all(str(each).startswith(begins) for each in values[:1])
                   for event, *values in self._events[since:])


@pytest.fixture(scope="module")
def sender(machine) -> Iterator[Sender]:
    """It, connected."""
    library = pytest.importorskip("grbl_streamer", reason="grbl-streamer missing: "
                                  "pip install -e '.[senders]'")
    with GrblStreamer(library, machine) as sender:
        yield sender


class TestGrblStreamer(Probes):
    version = "2.0.2"

    def test_overrides(self, ready, sender, machine):
        """The sender puts other feeds into the lines."""
        sender.streamer.set_feed_override(True)
        sender.streamer.request_feed(660)
        sender.start(["G0 X-10", "G1 X-15 F600"])
        reported = len(machine.reports)
        sender.wait()
        sender.streamer.set_feed_override(False)
        feeds = {int(report.fields["FS"].split(",")[0]) for report in machine.reports[reported:]
                 if -15 < report.position[0] < -10}
        assert max(feeds) == pytest.approx(660, abs=1)
