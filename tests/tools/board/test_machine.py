"""The machine behind the page, clock by clock on Amaranth's simulator."""

import struct
from dataclasses import dataclass, field

import numpy as np
import pytest

from fresa.machines.mill import PIXEL_STEPS, Z_TRAVEL
from tb.engines import AmaranthEngine, EngineError
from tb.milling import AUTOMATIC, BUTTON, SETTLE, ready_to_mill
from tools.board import machine as machines
from tools.board import plate
from tools.board.machine import Machine
from tools.board.messages import CORNER, PIXEL, Job

CORNER_PICTURE = np.array([[1, 0], [1, 1]], bool)
PATIENCE = 60_000


@pytest.fixture
def machine():
    """Give a machine with a picture of three pixels that steps every other clock."""
    made = build()
    yield made
    made.close()


def build(*, switches: int = 0, period: int = 2) -> Machine:
    job = Job(CORNER_PICTURE, "corner", period)
    engine = ready_to_mill(CORNER_PICTURE, AmaranthEngine, period=period, scan_bits=3,
                           traceable=True)
    return Machine(engine, job, switches=switches)


@dataclass
class Seen:
    """What a page has put together from snapshots."""

    clock: int = 0
    leds: bytes = b""
    display: bytes = b""
    position: tuple[int, ...] = ()
    words: tuple[int, ...] = ()
    path: list[tuple[int, int, int]] = field(default_factory=list)
    cut: list[int] = field(default_factory=list)
    plates: int = 0

    def look(self, machine: Machine) -> "Seen":
        snapshot = machine.snapshot(1.5)
        self.clock = int(struct.unpack("<df", snapshot.time)[0])
        self.leds, self.display = snapshot.leds, snapshot.display
        self.words, self.position = zip(*struct.iter_unpack("<Bi", snapshot.motors), strict=True)
        if snapshot.path_anew:
            self.path = []
        if snapshot.cut_anew:
            self.cut, self.plates = [], self.plates + 1
        self.path += np.frombuffer(snapshot.path, CORNER).tolist()
        self.cut += np.frombuffer(snapshot.cut, PIXEL).tolist()
        return self

    def to_end(self, machine: Machine, *, slice_: int = 400) -> "Seen":
        """Run until the job is done."""
        until = machine.clock + PATIENCE
        while not machine.done:
            assert machine.clock < until
            machine.run(slice_)
            self.look(machine)
        return self


def start(machine: Machine) -> None:
    """Put SW7 on and press BTN1, all at once, as somebody quick does."""
    machine.touch(AUTOMATIC, 0)
    machine.touch(AUTOMATIC, BUTTON["start"])
    machine.touch(AUTOMATIC, 0)
    machine.run(5 * SETTLE)


class TestJob:
    def test_to_the_end(self, machine):
        seen = Seen().look(machine)
        assert (seen.clock, seen.position, seen.plates) == (0, (0, 0, 0), 1)
        assert not machine.done and not machine.busy
        start(machine)
        assert machine.busy
        seen.to_end(machine)
        assert sorted(seen.cut) == [0, 2, 3]
        assert seen.position == (0, 0, 0)
        assert (machine.cut().missed, machine.cut().in_error) == (0, 0)
        # Down in the first pixel, along the two others, home through the air.
        assert [place[:2] for place in seen.path] == [
            (0, 0), (PIXEL_STEPS, 0), (PIXEL_STEPS, PIXEL_STEPS)]
        assert [flags for *_, flags in seen.path] == [0, 1, 1]

    @pytest.mark.long
    def test_looking_rarely_or_often_is_the_same(self):
        paths = []
        for slice_ in (97, 1 << 20):
            machine = build()
            seen = Seen().look(machine)
            start(machine)
            seen.to_end(machine, slice_=min(slice_, 20_000))
            paths.append((seen.path, seen.cut, seen.position))
            machine.close()
        assert paths[0] == paths[1]

    def test_the_next_job_has_a_new_plate(self, machine):
        seen = Seen().look(machine)
        start(machine)
        seen.to_end(machine)
        plates = seen.plates
        first = machine.cut()
        start(machine)
        seen.look(machine)
        assert (seen.plates, seen.cut) == (plates + 1, [])
        seen.to_end(machine)
        assert sorted(seen.cut) == [0, 2, 3]
        assert machine.cut().right
        assert machine.cut().clocks == pytest.approx(first.clocks, abs=50)
        assert machine.cut().job_seconds() == pytest.approx(first.job_seconds(), abs=1e-3)

    def test_power_up_with_the_switch_on(self):
        machine = build(switches=AUTOMATIC)
        machine.run(3 * SETTLE)
        assert Seen().look(machine).leds[7] > 0
        machine.close()


class TestPlate:
    def test_origin_is_where_automatic_mode_is_entered(self, machine):
        """Jogged off and set to automatic mode, the picture is milled from there."""
        machine.touch(0b000001, 0)
        machine.run(400)
        machine.touch(0, 0)
        machine.run(400)
        seen = Seen().look(machine)
        x = seen.position[0]
        assert x > 100 and seen.position[1:] == (0, 0)
        assert seen.plates == 1
        start(machine)
        seen.look(machine)
        assert seen.path[:1] == [(0, 0, 0)] and seen.position[0] == 0
        seen.to_end(machine)
        assert machine.cut().right

    def test_mode_change_in_the_middle(self, machine):
        """The tool is left in the plate, and stays there; raised, it has a new plate below it."""
        start(machine)
        while Seen().look(machine).position[2] < Z_TRAVEL:
            machine.run(500)
        machine.run(100)
        machine.touch(0, 0)
        machine.run(50)
        assert not machine.busy
        assert Seen().look(machine).position[2] == Z_TRAVEL
        assert not machine.lost  # by hand anything may be
        machine.touch(AUTOMATIC, 0)
        machine.run(50)
        assert Seen().look(machine).position[2] == Z_TRAVEL
        assert machine.lost
        machine.touch(0, 0)
        machine.touch(0b010000, 0)  # up by hand
        machine.run(3 * Z_TRAVEL)
        machine.touch(0, 0)
        machine.run(50)
        assert Seen().look(machine).position[2] < 0
        machine.touch(AUTOMATIC, 0)
        machine.run(50)
        assert Seen().look(machine).position == (0, 0, 0)
        assert not machine.lost

    def test_stop_reset_start_with_the_tool_in_the_plate(self, machine):
        """The machine takes it for raised; it is where it was, and goes deeper from there."""
        start(machine)
        while Seen().look(machine).position[2] < Z_TRAVEL:
            machine.run(500)
        assert not machine.lost
        for button in ("stop", "reset"):
            machine.touch(AUTOMATIC, BUTTON[button])
            machine.touch(AUTOMATIC, 0)
            machine.run(5 * SETTLE)
        seen = Seen().look(machine)
        x, y, z = place = seen.position
        assert z >= Z_TRAVEL and machine.lost and not machine.busy
        machine.touch(AUTOMATIC, BUTTON["start"])
        machine.touch(AUTOMATIC, 0)
        machine.run(5 * SETTLE)
        assert machine.busy and machine.lost
        deepest, plates = z, seen.plates
        while machine.busy:
            machine.run(400)
            seen.look(machine)
            deepest = max(deepest, seen.position[2])
        assert deepest == z + Z_TRAVEL
        assert seen.position == (x, y, z) == place and seen.plates == plates
        assert machine.lost and not machine.done and machine.cut().in_error

    def test_path_is_bounded(self, machine, monkeypatch):
        monkeypatch.setattr(plate, "MOST_CORNERS", 10)
        seen = Seen().look(machine)
        for n in range(30):
            machine.touch(1 << n % 2, 0)
            machine.run(60)
            seen.look(machine)
            assert len(seen.path) <= 12
        assert seen.plates == 1
        x, y, _ = seen.path[-1]
        assert (x, y) != (0, 0)


class TestContacts:
    def test_none_is_left_out(self, machine):
        """A press shorter than a slice is seen by the gateware all the same."""
        start(machine)
        assert machine.busy

    def test_are_bounded(self, machine):
        for n in range(10 * machines.MOST_CONTACTS):
            machine.touch(n % 256, 0)
        machine.touch(AUTOMATIC, 0)
        machine.run(2 * SETTLE * machines.MOST_CONTACTS)
        assert Seen().look(machine).leds[7] > 0  # the last one counts


class TestRun:
    def test_makes_what_is_asked(self, machine):
        for clocks in (1, 2, 50, 333):
            before = machine.clock
            assert machine.run(clocks) == (clocks, False)
            assert machine.clock == before + clocks

    def test_once_stops_at_the_clock_of_a_step(self, machine):
        machine.touch(0b000100, 0)
        machine.run(SETTLE)
        words = Seen().look(machine).words
        clocks = []
        for _ in range(5):
            assert machine.run(1000, once=True)[1]
            seen = Seen().look(machine)
            assert seen.words[1] != words[1]
            words = seen.words
            clocks.append(machine.clock)
        assert (np.diff(clocks)[1:] == 2).all()

    def test_once_ends_without_a_step(self, machine):
        assert machine.run(200, once=True) == (200, False)

    def test_lights_of_one_clock(self, machine):
        """Clock by clock one sees the digits take their turns."""
        start(machine)
        Seen().look(machine)
        turns = set()
        for _ in range(32):
            machine.run(1)
            display = Seen().look(machine).display
            turns.add(tuple(any(display[8 * n:8 * n + 8]) for n in range(4)))
        assert turns == {(0, 0, 0, 0), *(tuple(n == m for n in range(4)) for m in range(4))}

    def test_lights_stay_while_nothing_runs(self, machine):
        machine.touch(AUTOMATIC, 0)
        machine.run(200)
        seen = Seen().look(machine)
        assert seen.leds[7] > 200 and any(seen.display)
        again = Seen().look(machine)
        assert (again.leds, again.display) == (seen.leds, seen.display)


class TestRecord:
    def test_window(self, machine, tmp_path):
        machine.run(100)
        machine.record(tmp_path / "it.vcd", 250)
        assert machine.recording and machine.recorded() is None
        while (window := machine.recorded()) is None:
            machine.run(100)
        assert machine.clock == 350
        assert not machine.recording and machine.recorded() is None
        assert window == (str(tmp_path / "it.vcd"), 100, 250, 250,
                          (tmp_path / "it.vcd").stat().st_size)
        text = (tmp_path / "it.vcd").read_text()
        assert "#2000000000\n" in text and "#1980000000\n" not in text  # 100 clocks of 20 ns

    def test_is_bounded_in_bytes(self, machine, tmp_path, monkeypatch):
        monkeypatch.setattr(machines, "LARGEST_WAVE", 50_000)
        machine.record(tmp_path / "it.vcd", 1_000_000)
        while (window := machine.recorded()) is None:
            machine.run(100)
        assert 50_000 <= window.size < 500_000
        assert window.clocks == machine.clock

    def test_one_at_a_time(self, machine, tmp_path):
        machine.record(tmp_path / "1.vcd", 200)
        machine.run(50)
        with pytest.raises(EngineError, match="wait until it ends$"):
            machine.record(tmp_path / "2.vcd", 100)
        while (window := machine.recorded()) is None:
            machine.run(100)
        assert (window.path, window.clocks) == (str(tmp_path / "1.vcd"), 200)

    def test_can_end_early(self, machine, tmp_path):
        machine.record(tmp_path / "it.vcd", 200)
        machine.run(50)
        window = machine.recorded(whole=False)
        assert window is not None and (window.clocks, window.requested) == (50, 200)
        assert not machine.recording and "#1000000000\n" in (tmp_path / "it.vcd").read_text()

    def test_without_a_clock_there_is_none(self, machine, tmp_path):
        machine.run(50)
        machine.record(tmp_path / "it.vcd", 200)
        with pytest.raises(EngineError, match="before its first clock"):
            machine.recorded(whole=False)
        assert not machine.recording and list(tmp_path.iterdir()) == []

    def test_a_file_that_is_gone_ends_it(self, machine, tmp_path):
        machine.record(tmp_path / "it.vcd", 200)
        (tmp_path / "it.vcd").unlink()
        machine.run(50)
        with pytest.raises(EngineError, match="file is gone"):
            machine.recorded()
        assert not machine.recording and machine.recorded() is None
        assert machine.run(50) == (50, False)


class TestStop:
    def test_holds_until_reset(self, machine):
        """What it says is what the gateware does."""
        stop, reset = BUTTON["stop"], BUTTON["reset"]
        for buttons, stopped in [(0, False), (stop, True), (0, True), (stop | reset, False),
                                 (stop, True), (reset, False), (0, False)]:
            machine.touch(0, buttons)  # after reset, a switch must be let go of before it counts
            machine.run(2 * SETTLE)
            machine.touch(0b01, buttons)
            machine.run(2 * SETTLE)
            assert machine.stopped is stopped
            before = Seen().look(machine).position
            machine.run(100)
            moved = Seen().look(machine).position != before
            assert moved is (not buttons and not stopped)


