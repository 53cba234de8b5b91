"""What is tried with each sender."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Self

import pytest

from tests.senders.machine import HOME, Machine, until

__all__ = ["END", "INCH", "JOB", "Jogs", "Overrides", "Probes", "Sender", "Session"]

#: More blocks than fit into the queue, so that a sender has to wait for answers.
JOB = ["(A pocket, and a zigzag)", "G21 G90 G94 G17", "M3 S500", "G0 X-10 Y-10", "G1 Z-2.5 F600",
       "G2 X-10 Y-10 I2 J0 F1500", "G3 X-6 Y-10 R2", "G1 X-5 Y-5 ; to the first corner",
       *(f"X{-4.5 - number % 2 / 2}Y{-5 - number / 20}" for number in range(90)),
       "M5", "G0 Z-1", "G0 X-3 Y-4", "M2"]
END = (-3, -4, -1)
INCH = 25.4
ANSWERED = 75
"""Answers after which the queue has been full, and lines wait in the sender."""


class Sender(ABC):
    """A sender, as these tests use it. In a ``with`` it is connected."""

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *_: object) -> None:
        self.disconnect()

    @abstractmethod
    def version(self) -> str:
        """Return the version that is installed."""

    @abstractmethod
    def connect(self) -> None:
        """Open the port; return when the sender is ready."""

    @abstractmethod
    def disconnect(self) -> None:
        """Close the port."""

    @abstractmethod
    def check(self) -> None:
        """Assert that it has understood what the machine says of itself."""

    @abstractmethod
    def position(self) -> tuple[float, ...]:
        """Return where it shows the machine, in the machine's coordinates."""

    @abstractmethod
    def send(self, line: str) -> None:
        """Send a line that its user has typed."""

    @abstractmethod
    def home(self) -> None:
        """Home the machine."""

    @abstractmethod
    def unlock(self) -> None:
        """End an alarm."""

    @abstractmethod
    def start(self, program: Sequence[str]) -> None:
        """Begin to stream a program."""

    @abstractmethod
    def wait(self) -> None:
        """Wait until the sender holds the program to be done."""

    @abstractmethod
    def hold(self) -> None:
        """Hold."""

    @abstractmethod
    def resume(self) -> None:
        """Go on."""

    @abstractmethod
    def reset(self) -> None:
        """End a program by a reset; return when the sender is ready for the next."""


@pytest.mark.senders
class Session:
    """What each sender does; a module has a fixture ``sender``, which is connected.

    Attributes
    ----------
    version : str
        That docs/gcode.md names.
    """

    version: str

    @pytest.fixture
    def ready(self, sender: Sender, machine: Machine) -> None:
        """A machine that is not locked."""
        if not machine.reports or machine.reports[-1].state == "Alarm":
            sender.unlock()

    def test_version(self, sender):
        assert sender.version() == self.version

    def test_connect(self, sender, machine):
        sender.check()
        assert machine.refused(0) == []

    def test_home(self, sender, machine):
        sender.home()
        assert machine.wait_to_be("Idle").position == HOME
        machine.wait(lambda: sender.position() == HOME, "the position in the sender")

    def test_stream(self, ready, sender, machine):
        self._run(sender, machine)

    def test_hold_and_resume(self, ready, sender, machine):
        begun = self._begin(sender, machine)
        sender.hold()
        held = machine.wait_to_be("Hold")
        machine.wait(lambda: machine.reports[-1].fields["FS"].startswith("0,"), "rest")
        held = machine.wait_to_be("Hold")
        assert machine.wait_to_be("Hold").position == held.position
        assert held.position != END
        sender.resume()
        self._finish(sender, machine, begun)

    def test_reset(self, ready, sender, machine):
        self._begin(sender, machine)
        reported = len(machine.reports)
        sender.reset()
        # No alarm: the position is still known, and the next program ends where it should.
        stands = machine.wait_to_be("Idle")
        assert "Alarm" not in {report.state for report in machine.reports[reported:]}
        assert stands.position != END
        machine.wait(lambda: sender.position() == stands.position, "the position in the sender")
        self._run(sender, machine)

    def test_reconnect(self, ready, sender, machine):
        sender.disconnect()
        sender.connect()
        sender.check()
        self._run(sender, machine)

    def test_inches(self, ready, sender, machine):
        """With $13=1 the same job ends at the same place, which it shows as it is reported."""
        inches = pytest.approx([each / INCH for each in END], abs=1e-4)
        self._report(sender, machine, inches=True)
        try:
            begun = self._begin(sender, machine)
            sender.wait()
            assert machine.refused(begun) == []
            place = machine.wait_to_be("Idle").position
            assert place == inches
            machine.wait(lambda: sender.position() == place, "the position in the sender")
        finally:
            self._report(sender, machine, inches=False)
        machine.wait(lambda: machine.reports[-1].position == sender.position() == END, "mm")

    def _report(self, sender: Sender, machine: Machine, *, inches: bool) -> None:
        """Let reports be in inches, or not."""
        begun = len(machine.received)
        sender.send(f"$13={int(inches)}")
        machine.wait_for("ok", begun)

    def _begin(self, sender: Sender, machine: Machine) -> int:
        """Start the job, and wait until it is in its middle; return the number of the next line."""
        begun = len(machine.received)
        sender.start(JOB)
        machine.wait_for("ok", begun, ANSWERED)
        return begun

    def _finish(self, sender: Sender, machine: Machine, begun: int) -> None:
        """Wait for the end of the job, and check it."""
        sender.wait()
        assert machine.refused(begun) == []
        assert machine.count("ok", begun) >= len(JOB) - 1  # without the comment
        machine.wait(lambda: machine.reports[-1].state == "Idle", "Idle")
        assert machine.reports[-1].position == END
        machine.wait(lambda: sender.position() == END, "the position in the sender")

    def _run(self, sender: Sender, machine: Machine) -> None:
        self._finish(sender, machine, self._begin(sender, machine))


class Jogs(Session):
    """A session with a sender that jogs."""

    def test_jog(self, ready, sender, machine):
        begun = len(machine.received)
        x, y, z = machine.wait_to_be("Idle").position
        sender.jog("X-1")
        machine.wait(lambda: machine.count("error:.*", begun)
                     or machine.reports[-1].position == (x - 1, y, z), "the place")
        assert machine.refused(begun) == []


class Overrides(Session):
    """A session with a sender that has overrides."""

    def test_overrides(self, ready, sender, machine):
        for chosen in [(110, 50, 110), (100, 100, 100)]:
            wanted = ",".join(map(str, chosen))
            begun = len(machine.reports)
            sender.override(*chosen)

            # One after the other, so that reports between show some of them.
            machine.wait(lambda wanted=wanted, begun=begun: any(
                report.fields.get("Ov") == wanted for report in machine.reports[begun:]),
                "overrides")


class Probes(Session):
    """A session with a sender that takes over where a probe has touched."""

    def test_probing(self, ready, sender, machine):
        *_, z = machine.wait_to_be("Idle").position
        begun, machine.surface = len(machine.received), z - 1
        sender.probe(f"G38.2 Z{z - 40:g} F120")
        touched = machine.wait_for(r"\[PRB:.*:1\]", begun)
        place = tuple(map(float, machine.received[touched - 1][5:-3].split(",")))
        assert z - 40 < place[2] <= machine.surface
        until(lambda: sender.probed() == place, "the place in the sender")
        machine.surface = -math.inf
        assert machine.refused(begun) == []
