# amaranth: UnusedElaboratable=no

"""`gcode` with backlash: the load is where the program says, however often an axis turns."""

import random

import pytest

from tb.engines import CXXRTLEngine, Engine
from tests.hdl.machines.test_gcode import SETTINGS, STEPS, Session, elaborated_once

pytestmark = pytest.mark.compiler

BACKLASH = (8, 0, 25)
"""In steps of X, Y and Z."""


class Geared(Session):
    """The loads, which gears with backlash move: at rest they may be where that leaves them."""

    def __init__(self, engine: Engine) -> None:
        self.load = [0, 0, 0]
        self.seen = 0
        super().__init__(engine)
        assert self.send("$220=0.1\n$222=0.1\n$223=4000\n") == ["ok"] * 3

    def loads(self) -> list[int]:
        """Return where the loads are, from what the motors have done since."""
        for _, motors in self.path[self.seen:]:
            for axis, (motor, slack) in enumerate(zip(motors, BACKLASH, strict=True)):
                self.load[axis] = min(max(self.load[axis], motor - slack), motor)
        self.seen = len(self.path)
        return self.load


@pytest.fixture
def machine():
    with CXXRTLEngine(elaborated_once()) as engine:
        yield Geared(engine)
        assert not engine.get("fault")


def test_loads_end_where_lines_and_arcs_do(machine):
    rng = random.Random(5)
    for line in ("G1X1Y1Z1F3000", "X2", "X1.5Z0.5", "G2X1.5Y1I1F3000", "G91G1X0.0125", "X-0.0125",
                 "G90X0Y0Z0", *(f"X{rng.uniform(-1, 1):.2f}Z{rng.uniform(-1, 1):.2f}"
                                for _ in range(5)), "X0Y0Z0"):
        assert machine.send(line + "\n") == ["ok"]
        state, at = machine.state()
        assert state == "Idle"
        assert machine.loads() == [
            pytest.approx(place * float(per_mm), abs=0.3)
            for place, per_mm in zip(at, SETTINGS.steps_per_mm, strict=True)]
    assert machine.position[2] == 0  # the last way was down
    assert machine.loads() == [0, 0, 0]


def test_steps_are_added_at_the_rate_that_is_set(machine):
    """The load moves when all are made; those of the line go on meanwhile."""
    assert machine.send("G1X0.5F60\n") == ["ok"]
    machine.path.clear()
    assert machine.send("X0\n") == ["ok"]
    times = [clock for clock, _ in machine.path]
    assert len(times) == 40 + 8
    period = SETTINGS.clock / 4000
    early = [b - a for a, b in zip(times, times[1:], strict=False) if b < times[0] + 7 * period]
    assert period - 20 <= max(early) <= period + 20
    late = [b - a for a, b in zip(times[12:-8], times[13:-8], strict=False)]
    assert min(late) > period  # a step of 1 mm/s each 12.5 ms


def test_a_stop_adds_nothing_and_what_is_missing_comes_with_the_next_step(machine):
    assert machine.send("G1X0.5F60\n") == ["ok"]
    machine.send("X0.25\n", wait=False, read=False)
    while len(machine.path) < 40 + 8 + 3:
        machine.run(50)
    machine.engine.set(stop=1)
    machine.run(200)
    machine.engine.set(stop=0)
    stands = list(machine.position)
    machine.run(200_000)
    machine.send("\x18")
    machine.send("$X\n")
    assert machine.position == stands
    assert machine.send("G1X0.25F60\n") == ["ok"]
    assert machine.loads()[0] == STEPS // 4


def test_a_change_of_the_setting_moves_nothing(machine):
    assert machine.send("G1X0.5F600\n") == ["ok"]
    before = list(machine.position)
    assert machine.send("$220=0\n") == ["ok"]
    machine.run(50_000)
    assert machine.position == before
    assert machine.send("G1X0\n") == ["ok"]
    assert machine.position[0] == 0
