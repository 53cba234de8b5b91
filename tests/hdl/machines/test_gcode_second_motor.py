# amaranth: UnusedElaboratable=no

"""`gcode` with a second motor on Y: both make the same steps, and homing squares the gantry."""

import random
from dataclasses import replace
from typing import cast

import pytest

from fresa.machines.gcode import GCode
from tb.boards import component
from tb.engines import CXXRTLEngine, Engine
from tests.hdl.machines.test_gcode import GREETING, LOCKED, SETTINGS, UNLOCKED, Session

pytestmark = [pytest.mark.compiler, pytest.mark.long]

PER_MM = 40
"""Steps of Y."""
PULL_OFF = 16
HOMED = ("$22=1", "$24=750", "$25=3000", "$27=0.4", "$130=10", "$131=16", "$132=5")
ALONE = 16 * PER_MM // 16
"""Steps that a motor of Y makes without the other one: a sixteenth of the travel."""


class Second:
    """An engine that counts the steps of the second motor in whatever runs."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._high = 0
        self._first_high = 0
        self.steps: list[tuple[int, int]] = []  # of the second motor, with its direction pin
        self.first: list[tuple[int, int]] = []

    def __getattr__(self, name: str):
        return getattr(self._engine, name)

    def run(self, clocks: int, names: tuple[str, ...]):
        """Run, and look at the pins of both motors."""
        seen = self._engine.run(clocks, (*names, "second_step", "second_direction"))
        for clock, step, direction, second, way in zip(*(
                each.tolist() for each in (seen.clock, seen["step"] >> 1 & 1,
                                           seen["direction"] >> 1 & 1, seen["second_step"],
                                           seen["second_direction"])), strict=True):
            if step and not self._first_high:
                self.first.append((clock, direction))
            if second and not self._high:
                self.steps.append((clock, way))
            self._first_high, self._high = step, second
        return seen


class Gantry(Session):
    """Two carriages, a motor each, and a switch for each; X and Z have switches at 1 mm.

    `places` are those of the two switches of Y in steps, and `skew` is how far the second carriage
    is ahead.
    """

    def __init__(self, engine: Engine, places: tuple[int, int] = (10**6, 10**6), skew: int = 0,
                 *, lower: bool = False) -> None:
        self.pins = Second(engine)
        self.places, self.skew, self.lower = places, skew, lower
        self.stuck = 0  # switches of Y that stay on
        super().__init__(cast(Engine, self.pins))

    def carriages(self) -> tuple[int, int]:
        """Return where the carriages are, in steps."""
        ways = [1 if way else -1 for _, way in self.pins.steps]
        return self.position[1], self.skew + sum(ways)

    def switches(self) -> list[bool]:
        """Return which of the switches of Y are on."""
        return [bool(self.stuck >> each & 1) or (at <= place if self.lower else at >= place)
                for each, (at, place) in enumerate(zip(self.carriages(), self.places, strict=True))]

    def run(self, clocks: int) -> None:
        """Let time pass, and the axes meet their switches."""
        if self.places[0] >= 10**6:
            super().run(clocks)
            return
        end = self.engine.clock + clocks
        while self.engine.clock < end:
            super().run(min(500, end - self.engine.clock))
            first, second = self.switches()
            self.engine.set(second_limit=second, limits=(
                (self.position[0] >= 80) | first << 1 | (self.position[2] >= 250) << 2))

    def home(self) -> list[str]:
        """Carry out a homing cycle; return what it said."""
        for line in HOMED:
            assert self.send(line + "\n") == ["ok"]
        assert self.send(f"$23={2 * self.lower}\n") == ["ok"]
        self.send("$H\n", wait=False, read=False)
        while not (answers := self.read()):
            self.run(10_000)
            assert self.engine.clock < 40_000_000
        return answers


@pytest.fixture(scope="module")
def design():
    return component("gcode", GCode(settings=replace(SETTINGS, second_motor="y")))


@pytest.fixture
def gantry(design):
    with CXXRTLEngine(design) as engine:
        yield Gantry(engine)
        assert not engine.get("fault")


def test_both_motors_make_the_same_steps_at_the_same_time(gantry):
    rng = random.Random(3)
    assert gantry.send("$221=0.1\n$223=4000\n") == ["ok", "ok"]
    for line in ("G1X1Y1F6000", "G2X1Y1I1F3000", *(
            f"G1X{rng.uniform(-1, 1):.2f}Y{rng.uniform(-1, 1):.2f}" for _ in range(6)), "X0Y0Z0"):
        assert gantry.send(line + "\n") == ["ok"]
    assert len(gantry.pins.first) > 300
    assert gantry.pins.steps == gantry.pins.first
    assert gantry.engine.get("second_direction") == gantry.engine.get("direction") >> 1 & 1


def test_direction_of_the_second_motor_is_inverted_by_bit_3(gantry):
    assert gantry.send("$3=8\nG0Y1\nY0\n") == ["ok"] * 3
    assert gantry.pins.first == [(clock, 1 - way) for clock, way in gantry.pins.steps]
    assert [way for _, way in gantry.pins.first] == [1] * 40 + [0] * 40
    assert gantry.send("$3=10\nG0Y1\n") == ["ok"] * 2
    assert [pins[-1][1] for pins in (gantry.pins.first, gantry.pins.steps)] == [0, 0]
    assert gantry.send("$3=16\n$3=2\nG0Y2\n") == ["error:38", "ok", "ok"]
    assert [pins[-1][1] for pins in (gantry.pins.first, gantry.pins.steps)] == [0, 1]


@pytest.mark.parametrize("pin", ["stop", "motor_fault", "limits", "second_limit"])
def test_a_stop_loses_the_same_steps_of_both(gantry, pin):
    assert gantry.send("$221=0.1\n$223=4000\n") == ["ok", "ok"]
    for number in range(6):
        gantry.send(f"G1Y{2 if number % 2 else -2}F6000\n", wait=False)
        gantry.run(60_000 + 1711 * number)
        gantry.engine.set(**{pin: 1})
        gantry.run(100)
        made = len(gantry.pins.steps)
        gantry.run(100_000)
        assert gantry.engine.get("alarm") == 1
        assert len(gantry.pins.steps) - made <= 1
        assert gantry.pins.steps == gantry.pins.first
        if pin.endswith("limit"):
            assert "ALARM:1" in gantry.read()
            assert "|Pn:Y" in gantry.send("?", wait=False)[0]
        gantry.engine.set(**{pin: 0})
        assert gantry.send("\x18", wait=False)[-2:] == [GREETING, LOCKED]
        assert gantry.send("$X\n") == [UNLOCKED, "ok"]
    assert gantry.send("G0Y0\n") == ["ok"]
    assert gantry.pins.steps == gantry.pins.first
    assert abs(gantry.position[1]) <= 4  # and the backlash


def test_contacts_of_both_switches_may_open(gantry):
    gantry.send("$5=1\n", wait=False)
    gantry.engine.set(limits=7, second_limit=1)
    gantry.run(1000)
    gantry.read()
    gantry.send("\x18$X\n", wait=False)
    assert gantry.state()[0] == "Idle"
    gantry.engine.set(second_limit=0)
    gantry.run(12_000)
    assert gantry.read()[0] == "ALARM:1"


@pytest.mark.parametrize(("places", "skew"), [
    ((60, 60), 0),  # square
    ((60, 85), 0),  # the second switch is further away
    ((60, 60), 30),  # the second carriage is ahead
    ((60, 57), -25), ((75, 60), 0)])
@pytest.mark.parametrize("lower", [False, True])
def test_homing_squares_the_gantry(design, places, skew, lower):
    if lower:
        places, skew = (-places[0], -places[1]), -skew
    with CXXRTLEngine(design) as engine:
        gantry = Gantry(engine, places, skew, lower=lower)
        assert gantry.home() == ["ok"]
        assert gantry.state() == ("Idle", [-0.4, -15.6 if lower else -0.4, -0.4])
        for at, place in zip(gantry.carriages(), places, strict=True):
            assert abs(at - place - (PULL_OFF if lower else -PULL_OFF)) <= 1
        assert not any(gantry.switches())
        # From then on they move together.
        before = gantry.carriages()
        gantry.places = (10**6,) * 2
        made = len(gantry.pins.steps), len(gantry.pins.first)
        assert gantry.send(f"G91Y{1 if lower else -1}\n") == ["ok"]
        assert gantry.pins.steps[made[0]:] == gantry.pins.first[made[1]:]
        assert [at - was for at, was in zip(gantry.carriages(), before, strict=True)] == [
            PER_MM if lower else -PER_MM] * 2
        assert not engine.get("fault")


@pytest.mark.parametrize("skew", [ALONE + 20, -ALONE - 20])
def test_a_motor_goes_on_alone_for_a_sixteenth_of_the_travel(design, skew):
    with CXXRTLEngine(design) as engine:
        gantry = Gantry(engine, (100, 100), skew)
        gantry.send("$120=16000\n$121=16000\n$122=16000\n")
        assert gantry.home()[0] == "ALARM:9"
        gantry.run(100_000)
        lone = abs(len(gantry.pins.steps) - len(gantry.pins.first))
        assert ALONE < lone <= ALONE + 10  # and what it takes to brake
        gantry.read()
        assert gantry.send("$X\n") == [UNLOCKED, "ok"]
        made = len(gantry.pins.steps), len(gantry.pins.first)
        assert gantry.send("G91Y-0.5\n") == ["ok"]
        assert [len(gantry.pins.steps) - made[0], len(gantry.pins.first) - made[1]] == [20, 20]
        assert not engine.get("fault")


@pytest.mark.parametrize("stuck", [1, 2])
def test_either_switch_that_stays_on_is_an_alarm(design, stuck):
    with CXXRTLEngine(design) as engine:
        gantry = Gantry(engine, (20, 20))
        assert gantry.send("$21=0\n") == ["ok"]
        gantry.stuck = stuck
        assert gantry.home()[0] == "ALARM:8"


def test_a_reset_while_one_motor_is_alone_frees_the_other(design):
    with CXXRTLEngine(design) as engine:
        gantry = Gantry(engine, (40, 75))
        for line in (*HOMED, "$23=0"):
            assert gantry.send(line + "\n") == ["ok"]
        gantry.send("$H\n", wait=False, read=False)
        while len(gantry.pins.steps) < len(gantry.pins.first) + 10:
            gantry.run(1000)
            assert gantry.engine.clock < 40_000_000
        gantry.places = (10**6,) * 2
        gantry.engine.set(limits=0)
        gantry.send("\x18", wait=False)
        gantry.run(300_000)  # it brakes
        assert gantry.send("$X\n")[-2:] == [UNLOCKED, "ok"]
        made = len(gantry.pins.steps), len(gantry.pins.first)
        assert gantry.send("G91Y-1\n") == ["ok"]
        assert gantry.pins.steps[made[0]:] == gantry.pins.first[made[1]:]
        assert len(gantry.pins.first) - made[1] == PER_MM
        assert not engine.get("fault")
