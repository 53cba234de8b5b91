# amaranth: UnusedElaboratable=no

"""Homing of two strings: with a plant of both, from anywhere, and with switches that fail."""

import random
import re

import pytest

from fresa.motion import AlarmCode, StringHoming
from fresa.protocol import HomingStage
from tb.boards import component
from tb.engines import AmaranthEngine

PACE, MOST, MOST_OFF = 3, 40, 5
REST = (12, 15)


class Plant:
    """Two strings and their motors, which make a step a random while after it is requested."""

    def __init__(self, engine, lengths: list[int], seed: int, *,
                 stuck: dict[int, int] | None = None) -> None:
        self.engine, self.rng = engine, random.Random(seed)
        self.lengths = lengths  # from where the switch closes
        self.counts = [0, 0]  # of the motors
        self.stuck = stuck or {}
        self.wound, self.paid = [0, 0], [0, 0]
        self.order: list[HomingStage] = []
        self.last = [-100, -100]
        self.gaps: set[int] = set()
        self.clocks = 0
        self.places = self.restarts = 0
        engine.set(start=1)
        engine.run(1)
        engine.set(start=0)

    def switches(self) -> int:
        """Return which are on."""
        return sum(self.stuck.get(side, length <= 0) << side
                   for side, length in enumerate(self.lengths))

    def clock(self) -> tuple[bool, AlarmCode]:
        """Do a clock; return whether the cycle is through, and a failure."""
        engine = self.engine
        behind = [count != rest for count, rest in zip(self.counts, REST, strict=True)]
        engine.set(switches=self.switches(), allowed=int(self.rng.random() < 0.2),
                   behind=behind[0] | behind[1] << 1, moving=int(self.rng.random() < 0.5),
                   begins=int(self.rng.random() < 0.5))
        stage, step, longer, zero, place, follow, restart = engine.get(
            "stage", "step", "longer", "zero", "place", "follow", "restart")
        stage = HomingStage(stage)
        if not self.order or self.order[-1] != stage:
            self.order.append(stage)
        assert not (step and follow)
        moved = 0
        for side in range(2):
            wants = step >> side & 1 or (follow >> side & 1 and behind[side])
            # Not later than the pace.
            late = self.clocks - self.last[side] >= PACE - 2
            if wants and (self.rng.random() < 0.5 or late):
                moved |= 1 << side
                out = self.counts[side] < REST[side] if follow else longer >> side & 1
                self.lengths[side] += 1 if out else -1
                self.counts[side] += 1 if out else -1
                if step:
                    (self.paid if out else self.wound)[side] += 1
                self.last[side] = self.clocks
            elif not wants:
                self.last[side] = self.clocks
            if zero >> side & 1:
                assert not self.switches() >> side & 1
                self.counts[side] = 0
        self.places += place
        self.restarts += restart
        if restart:
            assert self.counts == [*REST]
        engine.set(moved=moved)
        done, failure, active = engine.get("done", "failure", "active")
        assert active
        engine.run(1)
        self.clocks += 1
        return bool(done), AlarmCode(failure)

    def run(self) -> AlarmCode:
        """Let a cycle be through, or fail."""
        for _ in range(5000):
            done, failure = self.clock()
            if done or failure != AlarmCode.NONE:
                return failure
        raise AssertionError("it does not end")


@pytest.fixture(scope="module")
def homing():
    return component("string_homing", StringHoming(pace=PACE, most=MOST, most_off=MOST_OFF))


@pytest.mark.parametrize("seed", range(6))
def test_both_strings_are_found_from_anywhere(homing, seed):
    rng = random.Random(seed)
    lengths = [rng.randint(-2, 30), rng.randint(1, 8)]
    with AmaranthEngine(homing) as engine:
        plant = Plant(engine, list(lengths), seed)
        assert plant.run() == AlarmCode.NONE
        # A string is 0 where its switch opens: the counts of both are those lengths.
        assert plant.counts == [*REST]
        assert plant.lengths == [1 + rest for rest in REST]
        assert plant.order == [HomingStage.NONE, HomingStage.FIRST, HomingStage.SECOND,
                               HomingStage.REST, HomingStage.NONE]
        assert plant.places == plant.restarts == 1
        assert plant.wound[0] == max(0, lengths[0])
        assert plant.paid[1] >= plant.wound[0]  # neither gets tight
        assert engine.get("active", "fault") == (0, 0)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize(("level", "code", "most"), [
    (0, AlarmCode.HOMING_SEARCH, MOST), (1, AlarmCode.HOMING_PULL_OFF, MOST_OFF)])
def test_a_switch_that_stays_is_an_alarm(homing, side, level, code, most):
    with AmaranthEngine(homing) as engine:
        plant = Plant(engine, [4, 3], side, stuck={side: level})
        assert plant.run() == code
        steps = (plant.paid if level else plant.wound)[side] - (
            plant.wound[0] if level and side else 0)
        assert most <= steps <= most + 1
        for _ in range(50):
            assert plant.clock() == (False, AlarmCode.NONE)
            assert engine.get("step", "follow", "zero", "place") == (0, 0, 0, 0)
        engine.set(rst=1)
        engine.run(1)
        engine.set(rst=0)
        assert engine.get("active") == 0


def test_the_pace_is_kept_and_slower_off_a_switch(homing):
    """By a motor that makes each step at once."""
    with AmaranthEngine(homing) as engine:
        engine.set(start=1, allowed=1)
        steps, on = [], 0
        for clock in range(200):
            step, longer = engine.get("step", "longer")
            engine.set(moved=step, switches=on)
            if step & 1:
                steps.append((clock, longer & 1))
            if len(steps) == 4:
                on = 1
            engine.run(1)
            if len(steps) == 7:
                break
    winds = [clock for clock, out in steps if not out]
    pays = [clock for clock, out in steps if out]
    assert [second - first for first, second in zip(winds, winds[1:], strict=False)] == [PACE] * 3
    assert [second - first for first, second in zip(pays, pays[1:], strict=False)] == [8 * PACE] * 2


@pytest.mark.parametrize(("parameters", "message"), [
    ({"pace": 1}, "pace of homing must be a whole number from 2 to 67108864, not 1"),
    ({"most": 0}, "most steps of homing must be a whole number from 1 to 1048576, not 0"),
    ({"most_off": 0}, "most steps off a switch must be a whole number from 1 to 1048576, not 0")])
def test_impossible(parameters, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        StringHoming(**{"pace": 2, "most": 1, "most_off": 1, **parameters})
