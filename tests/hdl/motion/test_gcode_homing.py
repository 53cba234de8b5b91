# amaranth: UnusedElaboratable=no

"""The homing cycle: what it wants of the planner, and what it makes of the switches."""

import random
from types import SimpleNamespace

import pytest

from fresa.motion import AlarmCode, GCodeHoming, HomingRequest
from tb.boards import component
from tb.engines import Engine, choose

VALUES = {24: 30_000, 25: 600_000, 27: 1_500, 130: 15_000, 131: 10_000, 132: 5_000}


STEP = 20
"""Way of an axis in a clock, in um."""


class Machine:
    """What is around the cycle; places are in um, counted from power-up."""

    def __init__(self, engine: Engine, switches: list[int], lower: int, seed: int = 0) -> None:
        self.engine, self.switches, self.lower = engine, switches, lower
        self.rng = random.Random(seed)
        self.at = [0, 0, 0]
        self.moving: tuple[int, int] | None = None  # axis and target
        self.home: dict[int, int] = {}  # where the switch of an axis was said to be
        self.latched = 0
        self.wait = self.begins = self.dwell = self.dwells = 0
        self.requests: list[tuple[int, ...]] = []
        self.failure = 0
        engine.set(start=1, lower=lower, only=3)
        engine.run(1)

    def on(self) -> int:
        """Return the switches."""
        return sum((at <= switch if self.lower >> axis & 1 else at >= switch) << axis
                   for axis, (at, switch) in enumerate(zip(self.at, self.switches, strict=True)))

    def move(self, axis: int, way: int) -> None:
        """Move an axis."""
        self.at[axis] += way

    def clock(self) -> bool:
        """Do a clock; return whether the cycle is through."""
        engine = self.engine
        self.begins = max(0, self.begins - 1)
        # While it dwells switches may bounce.
        engine.set(switches=self.rng.getrandbits(3) if self.dwell else self.on(),
                   moving=self.moving is not None or self.dwell > 0, standing=1,
                   begins=self.begins > 0, allowed=self.rng.getrandbits(1))
        brake, restart, latch, place, done, failure, axis, active = engine.get(
            "brake", "restart", "latch", "place", "done", "failure", "axis", "active")
        names = ("kind", "axis", "thousandths", "back", "from_switch", "near", "slow")
        want = SimpleNamespace(**dict(zip(names, engine.get(*(f"request_{name}" for name in names)),
                                        strict=True)))
        homed = False
        self.dwell = max(0, self.dwell - 1)
        if want.kind == HomingRequest.NONE.value:
            self.wait = 5
        else:
            assert self.moving is None and not self.begins and not self.dwell
            self.wait -= 1
            homed = self.wait == 0
            if want.kind == HomingRequest.WAIT.value:
                self.dwells += homed
                self.dwell = homed * self.rng.randint(1, 100)
            elif homed and want.kind == HomingRequest.MOVE.value:
                distance = VALUES[27 if want.near else 130 + want.axis]
                offset = distance * want.thousandths // 1000
                begin = self.home[want.axis] if want.from_switch else self.at[want.axis]
                self.moving = want.axis, begin + (-offset if want.back else offset)
                self.requests.append((want.axis, distance, want.thousandths, want.back,
                                      want.from_switch, VALUES[24 if want.slow else 25]))
            elif homed:
                offset = VALUES[130 + want.axis] * want.thousandths // 1000
                self.home[want.axis] = -offset if want.back else offset
        if brake:
            self.moving = None
        elif self.moving:
            moved, target = self.moving
            way = target - self.at[moved]
            self.move(moved, max(-STEP, min(STEP, way)))
            if not way:
                self.moving = None
        if latch:
            self.latched = self.at[axis]
        if place:
            shift = self.home[axis] - self.latched
            self.at[axis] += shift
            self.switches[axis] += shift
        if restart:
            self.begins = self.rng.randint(3, 30)
        self.failure = failure
        engine.set(homed=homed)
        engine.run(1)
        engine.set(homed=0, start=0)
        assert active
        return bool(done)

    def run(self) -> None:
        """Let a cycle be done, or fail."""
        for _ in range(20_000):
            if self.clock() or self.failure:
                return
        raise AssertionError("it does not end")


@pytest.fixture(scope="module")
def homing():
    return component("gcode_homing", GCodeHoming())


@pytest.mark.parametrize("lower", [0, 0b111, 0b010])
def test_each_axis_goes_to_its_switch_and_away(homing, lower):
    switches = [-5_000 if lower >> axis & 1 else 2_000 + 1_000 * axis for axis in range(3)]
    with choose()(homing) as engine:
        machine = Machine(engine, switches, lower)
        machine.run()
        assert not machine.failure
        for axis, (place, requests) in enumerate(
                (machine.at[axis], [each for each in machine.requests if each[0] == axis])
                for axis in range(3)):
            back = lower >> axis & 1
            travel = VALUES[130 + axis]
            assert place == (-travel + 1_500 if back else -1_500)
            assert requests == [
                (axis, travel, 1500, back, 0, 600_000), (axis, 1_500, 1000, 1 - back, 1, 600_000),
                (axis, 1_500, 5000, back, 0, 30_000), (axis, 1_500, 1000, 1 - back, 1, 600_000)]
        assert [each[0] for each in machine.requests] == [2] * 4 + [0] * 4 + [1] * 4
        assert machine.dwells == 11  # before each of them but the first
        engine.run(1)
        assert engine.get("active", "fault") == (0, 0)


def test_a_switch_that_is_not_found_is_an_alarm(homing):
    with choose()(homing) as engine:
        machine = Machine(engine, [10**6, 10**6, 4_000], 0)
        machine.run()
        assert machine.failure == AlarmCode.HOMING_SEARCH.value
        assert {each[0] for each in machine.requests} == {2, 0}
        engine.run(100)
        assert engine.get("failure", "active") == (0, 1)
        engine.set(rst=1)
        engine.run(1)
        engine.set(rst=0)
        assert not engine.get("active")


def test_a_switch_that_stays_on_is_an_alarm(homing):
    with choose()(homing) as engine:
        machine = Machine(engine, [0, 0, -5_000], 0)
        machine.run()
        assert machine.failure == AlarmCode.HOMING_PULL_OFF.value
        assert len(machine.requests) == 2


class Gantry(Machine):
    """Y has two carriages, at 0 and at `skew`, with a switch each, and makes a step in a clock."""

    def __init__(self, engine: Engine, places: tuple[int, int], skew: int, lower: int) -> None:
        self.carriages, self.places = [0, skew], places
        engine.set(travel=VALUES[131] // STEP)
        super().__init__(engine, [10_000 if not lower else -10_000] * 3, lower)
        self.switches[0] = self.switches[2] = -4_000 if lower else 4_000

    def met(self) -> list[bool]:
        """Return which of both switches are on."""
        return [at <= place if self.lower else at >= place
                for at, place in zip(self.carriages, self.places, strict=True)]

    def on(self) -> int:
        first, second = self.met()
        self.engine.set(second_switch=second, moved=0)
        return super().on() & 0b101 | first << 1

    def move(self, axis: int, way: int) -> None:
        if axis != 1:
            super().move(axis, way)
            return
        halt = self.engine.get("halt")
        if halt != 3:
            super().move(axis, way)
            self.engine.set(moved=1)
        for motor in range(2):
            self.carriages[motor] += 0 if halt >> motor & 1 else way


@pytest.fixture(scope="module")
def squaring():
    return component("gcode_homing", GCodeHoming(squared_axis=1))


@pytest.mark.parametrize(("places", "skew"), [
    ((4_000, 4_000), 0), ((4_000, 4_300), 0), ((4_500, 4_000), 0), ((4_000, 4_000), -400)])
@pytest.mark.parametrize("lower", [0, 0b111])
def test_two_motors_go_to_their_own_switches_and_away_together(squaring, places, skew, lower):
    sign = -1 if lower else 1
    places = sign * places[0], sign * places[1]
    with choose()(squaring) as engine:
        machine = Gantry(engine, places, sign * skew, lower)
        machine.run()
        assert not machine.failure
        assert machine.at == [-VALUES[130 + axis] + 1_500 if lower else -1_500
                              for axis in range(3)]
        for at, place in zip(machine.carriages, places, strict=True):
            assert abs(at - (place - sign * 1_500)) <= 3 * STEP
        assert engine.get("halt", "fault") == (0, 0)


@pytest.mark.parametrize("places", [(2_000, 2_800), (2_800, 2_000)])
def test_one_motor_does_not_go_on_for_more_than_a_sixteenth(squaring, places):
    with choose()(squaring) as engine:
        machine = Gantry(engine, places, 0, 0)
        machine.run()
        assert machine.failure == AlarmCode.HOMING_SEARCH.value
        first, second = machine.carriages
        most = VALUES[131] // 16
        assert most < abs(first - second) <= most + 4 * STEP
        engine.run(100)
        assert engine.get("halt") in (1, 2)  # while it brakes


@pytest.mark.parametrize("places", [(0, -2_000), (-2_000, 0)])
def test_either_switch_that_stays_on_is_an_alarm(squaring, places):
    with choose()(squaring) as engine:
        machine = Gantry(engine, places, 0, 0)
        machine.run()
        assert machine.failure == AlarmCode.HOMING_PULL_OFF.value


def test_a_line_that_begins_too_late_is_refused():
    with pytest.raises(ValueError, match="begins_within must be a whole number from 1 to 31"):
        GCodeHoming(begins_within=32)
