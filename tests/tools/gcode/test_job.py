"""Speed, acceleration and deviation from the times of steps."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from tests.tools.gcode.jobs import BEGIN, CLOCK, SETTINGS, job, moves
from tools.gcode.job import asked_steps
from tools.gcode.path import Asked
from tools.gcode.simulation import Steps


def test_speed_and_acceleration_are_those_of_the_steps():
    done = job(moves((0, 20, 100, 0.5), (0, -5, 200, 0)))
    motion = done.motion()
    first = 2 * sqrt(20 / 100)
    assert motion.length == pytest.approx(25, abs=0.02)
    assert motion.speed.max() == pytest.approx(sqrt(20 * 100), rel=0.02)
    for begin, end, expected in ((0.1, first / 2 - 0.1, 100), (first / 2 + 0.1, first - 0.1, -100),
                                 (first + 0.1, first + 0.4, 0), (first + 0.55, first + 0.6, 200)):
        middle = (motion.time > begin) & (motion.time < end)
        assert np.abs(motion.acceleration[middle] - expected).max() < 10
    standing = (motion.time > first + 0.1) & (motion.time < first + 0.4)
    assert motion.speed[standing].max() == 0
    assert motion.place[-1] == pytest.approx([15, 0, 0])


def test_a_slow_axis_goes_evenly():
    """Steps that are all far apart are no rests."""
    clock = (np.arange(1, 20) * 0.1 * CLOCK).astype(np.int64) + round(BEGIN * CLOCK)
    change = np.zeros((19, 3), np.int8)
    change[:, 2] = 1
    motion = job(Steps(clock, change)).motion()
    inside = (motion.time > 0.2) & (motion.time < 1.8)
    assert motion.speed[inside] == pytest.approx(np.full(inside.sum(), 10 / 400))


def test_steps_on_their_path():
    done = job(moves((0, 3, 100, 0.1), (1, 2, 100, 0.1), (0, -3, 100, 0)),
               "G1 X3 F1000", "Y2", "X0")
    assert done.deviation().distance < 1e-9
    facts = done.facts(done.motion(), done.deviation())
    assert facts["steps"] == {"x": 480, "y": 160, "z": 0}
    assert facts["end_mm"] == [0, 2, 0] and facts["end_steps"] == [0, 160, 0]
    assert (facts["asked_mm"], facts["seconds"], facts["lines"]) == (8, 3, 3)
    assert facts["made_mm"] == pytest.approx(8, abs=0.05)


def test_a_lost_step_and_a_wrong_one_are_seen():
    good = moves((0, 3, 100, 0.1), (1, 2, 100, 0.1), (0, -3, 100, 0))
    change = good.change.copy()
    change[100] = 0
    lost = job(Steps(good.clock, change), "G1 X3 F1000", "Y2", "X0")
    assert lost.deviation().distance == pytest.approx(1 / 80)
    change = good.change.copy()
    change[300, 0] = 7
    far = replace(lost, steps=Steps(good.clock, change))
    worst = far.deviation()
    assert worst.distance == pytest.approx(7 / 80) and worst.where[0] == pytest.approx(3 + 7 / 80)
    facts = far.facts(far.motion(), worst)
    assert facts["deviation_steps"] == pytest.approx(7) and not facts["right"]


def test_a_job_that_ends_too_early():
    facts = []
    for length in (3, 2.9):
        done = job(moves((0, length, 100, 0)), "G1 X3 F1000")
        facts.append(done.facts(done.motion(), done.deviation()))
    assert [each["right"] for each in facts] == [True, False]
    assert facts[1]["deviation_mm"] < 1e-9 and facts[1]["followed_mm"] == pytest.approx(2.9)


def test_nothing_moves():
    none = job(Steps(np.empty(0, np.int64), np.empty((0, 3), np.int8)), "G4 P3")
    motion = none.motion()
    assert motion.length == 0 and not motion.speed.any()
    facts = none.facts(motion, none.deviation())
    assert facts["steps"] == {"x": 0, "y": 0, "z": 0} and facts["deviation_steps"] == 0
    assert facts["right"]


def test_how_many_steps_are_to_come():
    program = Asked()
    for line in ("G1 X3 F1000", "G2 X3 I5 Z1", "G1 X0 Z0"):
        program.add(line)
    assert asked_steps(program.segments, SETTINGS) == pytest.approx(
        80 * (3 + 40 + 3) + 400 * 2, rel=0.01)
