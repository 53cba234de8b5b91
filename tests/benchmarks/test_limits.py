"""Limits at the pins: what is measured of them, and that one which is exceeded is found."""

import json
import random
from collections.abc import Iterable
from math import acos, hypot, inf, pi, sqrt

import numpy as np
import pytest

from benchmarks import limits
from benchmarks.limit_programs import KINDS, Arc, Limits, Piece, Program, program
from benchmarks.limit_windows import AlignmentError
from benchmarks.limits import MACHINE, Result, main, of_steps, summary
from tb.models.gcode_machine import MachineModel
from tb.models.gcode_plan import PlanSettings
from tools.gcode.simulation import Steps

CLOCK = MACHINE.clock


def moved(made: Program) -> Steps:
    """Run a program on the model of the machine, which is the gateware to the clock."""
    of = made.limits
    model = MachineModel(PlanSettings(
        CLOCK, [int(1e6 * rate) for rate in of.rates],
        [int(1e6 * each) for each in of.accelerations], [1000 * each for each in of.steps],
        round(1e6 * of.deviation)), MACHINE.driver)
    model.send("".join(f"{line}\n" for line in made.lines).encode())
    assert set(model.answers) == {"ok"}
    steps = [dict(each) for each in model.steps()]
    clocks = sorted(set().union(*steps))
    return Steps(np.array(clocks), np.array([[axis.get(clock, 0) for axis in steps]
                                             for clock in clocks], np.int8))


def results(made: Program, steps: Steps, claim: float = 1.0,
            kinds: Iterable[str] = KINDS) -> dict[str, Result]:
    """Measure a program that was run."""
    return summary(of_steps(made, steps, claim), kinds)


@pytest.fixture(scope="module")
def corners() -> tuple[Program, Steps]:
    """Corners on the model."""
    made = program("corners", random.Random("3 corners 0"))
    return made, moved(made)


def test_limits_are_reached_and_not_exceeded(corners):
    found = results(*corners, kinds=["corners"])
    assert set(found) == {"speed of an axis", "speed of a line", "acceleration of an axis, lines",
                          "step of velocity at a corner of lines"}
    for result in found.values():
        assert result.measured and 0.97 < result.least <= 1 <= result.highest < 1.01


def test_limits_that_are_lower_are_exceeded(corners):
    found = results(*corners, claim=0.9, kinds=["corners"])
    assert all(not result.right and result.least > 1.07 for result in found.values())


def test_steps_that_come_too_fast_are_found(corners):
    """In a time that is 1/1.05, with 1.05 the speed and 1.1 the acceleration."""
    made, steps = corners
    found = results(made, Steps((steps.clock / 1.05).astype(np.int64), steps.change))
    assert found["speed of an axis"].least > 1.03
    assert found["acceleration of an axis, lines"].least > 1.06
    assert found["step of velocity at a corner of lines"].least > 1.03


@pytest.mark.parametrize("kept", [slice(1, None), slice(None, -1)])
def test_a_step_that_is_missing_is_no_measurement(kept, corners):
    made, steps = corners
    with pytest.raises(AlignmentError, match="axis"):
        results(made, Steps(steps.clock[kept], steps.change[kept]))


def circle(radius: float, speed: float) -> tuple[Program, Steps]:
    """Make a circle of constant speed from edges in real numbers."""
    limits = Limits((3200, 2000, 400), (200.0,) * 3, (4000.0, 5000.0, 1000.0), 0.1)
    made = Program(limits)
    made.pieces.append(Piece((0, 0, 0), (0, 0, 0), speed, Arc((0, 1, 2), (-radius, 0.0), radius,
                                                             0.0, 2 * pi)))
    rows = []
    for axis, (per_mm, turned) in enumerate(zip(limits.steps[:2], (0, pi / 2), strict=True)):
        centre = (-radius, 0.0)[axis]
        for number in range(-int(3 * radius * per_mm), int(3 * radius * per_mm)):
            part = ((number + 0.5) / per_mm - centre) / radius
            if abs(part) < 1:
                for way, angle in (-1, turned + acos(part)), (1, turned - acos(part)):
                    rows.append((angle % (2 * pi) * radius / speed * CLOCK, axis, way))
    rows.sort()
    change = np.zeros((len(rows), 3), np.int8)
    for row, (_, axis, way) in enumerate(rows):
        change[row, axis] = way
    return made, Steps(np.array([round(clock) for clock, *_ in rows]), change)


@pytest.mark.parametrize("share", [0.9, 1.0, 1.2])
def test_an_arc_has_the_acceleration_of_its_circle(share):
    """The lower limit of both axes is compared with, and each axis has it at its extremes."""
    found = results(*circle(2.0, sqrt(share * 4000 * 2)))
    assert found["acceleration in the plane of an arc"].highest == pytest.approx(share, rel=0.02)
    assert found["acceleration of an axis, arcs"].highest == pytest.approx(share, rel=0.02)
    assert found["speed along an arc"].highest == pytest.approx(1, rel=0.003)
    assert found["acceleration in the plane of an arc"].right == (share <= 1)
    assert found["acceleration of an axis, arcs"].right == (share <= 1)


class TestPieces:
    ARC = Piece((0, 0, 0), (-2_000_000, 0, 1_000_000), 50.0, Arc((0, 1, 2), (-1.0, 0.0), 1.0, 0.0,
                                                                pi))

    def test_directions_of_a_helix(self):
        length = hypot(pi, 1)
        assert self.ARC.length == pytest.approx(length)
        assert self.ARC.unit(end=False) == pytest.approx([0, pi / length, 1 / length])
        assert self.ARC.unit(end=True) == pytest.approx([0, -pi / length, 1 / length])

    def test_steps_of_a_helix(self):
        assert self.ARC.edges((100, 100, 400)) == [200, 200, 400]

    def test_text(self):
        made = Program(Limits((100,) * 3, (1.0,) * 3, (1.0,) * 3, 0.01))
        made.line("G0", [1, 0, -0.5], inf)
        made.arc("G19", (1, 2, 0), "JK", radius=1, angle=0, sweep=-2 * pi, across=0.25, feed=10)
        assert made.lines == ["G0X1.000000Z-0.500000",
                              "G19G2Y0X0.250000J-1.000000K0.000000F600.000"]
        assert made.at == (1_250_000, 0, -500_000)

    @pytest.mark.parametrize("kind", KINDS)
    def test_programs_are_those_of_their_seed(self, kind):
        one, same, other = (program(kind, random.Random(seed)) for seed in (1, 1, 2))
        assert one.lines == same.lines != other.lines
        assert len(set(one.limits.accelerations)) == 3


@pytest.mark.parametrize(("claim", "status"), [("100", 0), ("90", 1)])
def test_the_command(claim, status, corners, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(limits, "run", lambda made: corners[1])
    file = tmp_path / "limits.json"
    assert main(["corners", "--programs", "1", "--seed", "3", "--jobs", "1", "--claim", claim,
                 "--json", str(file)]) == status
    facts = json.loads(file.read_text(encoding="utf-8"))
    assert facts["good"] == (not status) and len(facts["limits"]) == 4
    assert capsys.readouterr().out.count("EXCEEDED") == 4 * status
