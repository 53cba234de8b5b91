# amaranth: UnusedElaboratable=no

"""`gcode` in the dialect of the thesis: its session, its end stops, its motors and its servo."""

from fractions import Fraction
from math import hypot

import pytest

from fresa.machines.gcode import GCode, GCodeSettings
from tb.boards import component
from tb.engines import CXXRTLEngine, Engine
from tests.hdl.machines.test_gcode import Session

pytestmark = [pytest.mark.compiler, pytest.mark.long]

SETTINGS = GCodeSettings(
    dialect="thesis", clock=2_000_000, baud=100_000, steps_per_mm=(Fraction(10),) * 3,
    max_rate=(Fraction(30_000),) * 3, acceleration=(Fraction(16_000),) * 3,
    others=((25, Fraction(12_000)), (130, Fraction(90)), (131, Fraction(50))))
DOWN, UP = 500, 2500
"""Pulses of the servo, in us."""


class ThesisMachine(Session):
    """The machine with its end stops, below which nothing moves."""

    settings, steps_per_mm, greeting = SETTINGS, SETTINGS.steps_per_mm, "start"
    stops = (-200, -100)

    def __init__(self, engine: Engine) -> None:
        self.pulses: list[int] = []
        self.rose = 0
        super().__init__(engine)

    def run(self, clocks: int) -> None:
        """Let time pass; the end stops follow the axes."""
        end = self.engine.clock + clocks
        while self.engine.clock < end:
            self.engine.set(limits=sum((at <= stop) << axis for axis, (at, stop) in enumerate(
                zip(self.position, self.stops, strict=False))))
            super().run(min(200, end - self.engine.clock))

    def servo(self) -> float:
        """Return the length of the next whole pulse of the servo, in us."""
        while self.engine.get("servo"):
            self.run(100)
        while not self.engine.get("servo"):
            self.run(100)
        begin = self.engine.clock
        while self.engine.get("servo"):
            self.run(100)
        return (self.engine.clock - begin) / 2


@pytest.fixture(scope="module")
def design():
    return component("gcode", GCode(settings=SETTINGS))


@pytest.fixture
def machine(design):
    with CXXRTLEngine(design) as engine:
        yield ThesisMachine(engine)
        assert not engine.get("fault")


def test_the_session_of_the_thesis(machine):
    """Home with the tool up, a line, its example of an arc, a dwell in ms, motors off."""
    enable = machine.engine.get
    assert not enable("enable")
    machine.send("G28\n", wait=False)
    assert enable("enable")
    assert machine.servo() == pytest.approx(UP, abs=110)
    while "ok" not in machine.text:
        machine.run(2000)
    assert machine.read() == ["ok"]
    assert machine.position == [-200, -100, 0]
    assert machine.state() == ("Idle", [0, 0, 0])
    assert machine.servo() == pytest.approx(DOWN, abs=110)

    assert machine.send("G90\nG1 X60 Y10 F20000\n") == ["ok", "ok"]
    assert machine.position == [400, 0, 0]
    machine.path.clear()
    assert machine.send("G2 X60 Y30 I30 J10 F6000\n") == ["ok"]
    assert machine.position == [400, 200, 0]
    off = [hypot(x + 200 - 900, y + 100 - 200) - 1000**0.5 * 10 for _, (x, y, _) in machine.path]
    assert max(map(abs, off)) < 1

    begin = machine.engine.clock
    assert machine.send("G4 P200\nM0\n") == ["ok", "ok"]
    assert 200 <= (machine.engine.clock - begin) / 2000 < 220
    assert enable("enable")
    assert machine.send("M5\n") == ["ok"]
    assert not enable("enable")
    assert machine.send("M3\n") == ["ok"]
    assert enable("enable")


def test_where_the_tool_is_becomes_the_origin(machine):
    assert machine.send("G0 X5 Y3 Z1\nG92\nG0 X1\n") == ["ok"] * 3
    assert machine.position == [60, 30, 10]
    assert machine.state() == ("Idle", [6, 3, 1])
    assert machine.send("G92 Y9\nG0 Y10\n") == ["ok"] * 2
    assert machine.position == [60, 40, 10]


def test_motors_are_off_when_idle_and_go_on_by_themselves(machine):
    assert machine.send("G0 X1\n") == ["ok"]
    assert machine.engine.get("enable")
    machine.run(150_000)
    assert machine.engine.get("enable")
    machine.run(60_000)
    assert not machine.engine.get("enable")
    assert machine.send("G0 X2\n") == ["ok"]
    assert machine.engine.get("enable")
    assert machine.position == [20, 0, 0]


def test_motors_that_are_off_are_on_for_a_motion(machine):
    assert machine.send("M5\nG0 X1 M5\n") == ["ok", "ok"]
    assert machine.position == [10, 0, 0]
    assert not machine.engine.get("enable")


def test_silence_ends_a_line(machine):
    machine.send("G1 X1 F9000", wait=False)
    assert machine.read() == []
    assert machine.position == [0, 0, 0]
    machine.run(40_000)
    assert machine.read() == ["ok"]
    assert machine.position == [10, 0, 0]


def test_no_step_towards_an_end_stop_nor_beyond_the_length_and_the_place_is_known(machine):
    """Of lines that are planned before a step is missed the ends are off; the next one knows."""
    machine.send("G28\n", wait=False)
    while "ok" not in machine.text:
        machine.run(2000)
    machine.read()
    assert machine.send("G0 X100\nG0 Y20\n") == ["ok", "ok"]
    assert machine.position == [700, 100, 0]
    assert machine.state() == ("Idle", [90, 20, 0])
    assert machine.send("G1 X-5 Y25 F30000\nX3 Y20\n") == ["ok"] * 2
    assert machine.position == [-200 + 80, 100, 0]
    assert machine.state() == ("Idle", [8, 20, 0])
    assert machine.send("X3\n") == ["ok"]
    assert machine.position == [-170, 100, 0]
    assert min(x for _, (x, _, _) in machine.path) == -200


def test_z_above_0_lifts_the_tool(machine):
    assert machine.send("G0 Z1\n") == ["ok"]
    assert machine.servo() == pytest.approx(UP, abs=110)
    assert machine.send("G0 Z0\n") == ["ok"]
    machine.servo()
    assert machine.servo() == pytest.approx(DOWN, abs=110)


@pytest.mark.parametrize("line", ["G17", "G20", "G28 X1", "G90 G28", "M4", "M8", "M30", "G92.1",
                                  "G1.5", "M3.5", "N1 G28", "G28 G28"])
def test_what_the_firmware_has_not_is_refused(machine, line):
    assert machine.send(line + "\n") == ["error:20"]
    assert machine.send("G0 X1\n") == ["ok"]
    assert machine.position == [10, 0, 0]
    assert not machine.engine.get("spindle")


def test_lines_while_it_homes_wait(machine):
    machine.send("G0 X2\nG28\nG0 Y3\n?", wait=False)
    for _ in range(2000):
        machine.run(2000)
        if machine.text.count("ok") == 3:
            break
    machine.send("")
    assert machine.position == [-200, -70, 0]
    assert machine.state() == ("Idle", [0, 3, 0])
