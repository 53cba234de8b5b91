# amaranth: UnusedElaboratable=no

"""`gcode`: the settings of what is behind its pins, the driver modules, by what these see."""

from typing import cast

import pytest

from tb.engines import CXXRTLEngine, Engine
from tests.hdl.machines.test_gcode import (
    HOMED,
    SETTINGS,
    UNLOCKED,
    Session,
    Switches,
)

pytestmark = pytest.mark.compiler

WIDTH = SETTINGS.driver["width"]
MS = SETTINGS.clock // 1000


class Pins:
    """An engine that notes each change of STEP of X and of ENABLE in whatever runs."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self.changes: dict[str, list[tuple[int, int]]] = {"step": [], "enable": []}

    def __getattr__(self, name: str):
        return getattr(self._engine, name)

    def run(self, clocks: int, names: tuple[str, ...]):
        """Run, and look at the pins of the driver modules."""
        seen = self._engine.run(clocks, (*names, "enable"))
        for name, changes in self.changes.items():
            for clock, value in zip(seen.clock.tolist(), seen[name].tolist(), strict=True):
                if not changes or changes[-1][1] != value & 1:
                    changes.append((clock, value & 1))
        return seen

    def pulses(self, level: int = 1) -> list[int]:
        """Return the clocks of each pulse of STEP that has ended, and forget them."""
        changes = self.changes["step"]
        lengths = [end - begin for (begin, value), (end, _) in zip(
            changes, changes[1:], strict=False) if value == level]
        del changes[:-1]
        return lengths


@pytest.fixture
def session(design):
    with CXXRTLEngine(design) as engine:
        session = Session(cast("Engine", Pins(engine)))
        yield session
        assert not engine.get("fault")


@pytest.fixture
def pins(session) -> Pins:
    return session.engine


def test_pulses_have_the_time_of_a_setting(session, pins):
    for us, width in ((0.001, 1), (0.8, 2), (0.801, 3), (36, 90), (2.4, 6)):
        assert session.send(f"$0={us}\nG91G0X0.1Y-0.1\n") == ["ok", "ok"]
        assert pins.pulses() == [width] * 8
    assert session.send("$0=255.001\n") == ["error:38"]
    assert session.send("$112=1000\n") == ["ok"]
    # 8000 steps/s of X are possible with 312 clocks from pulse to pulse, of which 7 are the gap.
    assert session.send("$0=200\nG0X0.1\n") == ["error:12", "ok"]
    assert pins.pulses() == [6] * 8
    assert session.send("$0=122\n$110=6010\n$110=5000\n$0=140\n") == [
        "ok", "error:12", "ok", "ok"]
    assert session.send("G0X0.1\n") == ["ok"]
    assert pins.pulses() == [350] * 8


def test_step_pins_may_be_inverted(session, pins):
    assert session.send("G91G0X0.5Y0.5\n") == ["ok"]
    assert pins.pulses() == [WIDTH] * 40
    assert session.engine.get("step") == 0
    assert session.send("$2=5\n") == ["ok"]
    assert session.engine.get("step") == 0b101
    pins.pulses(0)
    before = list(session.position)
    assert session.send("G0X0.5Y0.5Z-0.1\nX-0.1\n") == ["ok", "ok"]
    assert pins.pulses(0) == [WIDTH] * 48
    assert [at - was for at, was in zip(session.position, before, strict=True)] == [32, 20, -25]
    assert session.send("\x18$2=8\n$2=2\n")[1:] == ["error:38", "ok"]
    assert session.engine.get("step") == 0b010


def test_enable_may_be_inverted(session):
    assert session.engine.get("enable") == 0
    assert session.send("$4=1\n") == ["ok"]
    assert session.engine.get("enable") == 1
    session.send("G0X0.1\n")
    assert session.engine.get("enable") == 0
    session.send("$SLP\n")
    assert session.engine.get("enable") == 1
    session.send("\x18$4=0\n")
    assert session.engine.get("enable") == 0


def off_after(session: Session, pins: Pins) -> float:
    """Return how many ms after the last edge of STEP of X the motors went off."""
    while session.engine.get("enable"):
        session.run(MS // 10)
    (off, level), (fell, _) = pins.changes["enable"][-1], pins.changes["step"][-1]
    assert level == 0
    return (off - fell) / MS


@pytest.mark.parametrize("delay", [0, 30])
def test_motors_are_off_after_a_motion(session, pins, delay):
    assert session.send(f"$1={delay}\nM3S100\n") == ["ok", "ok"]
    for at in 1, 2:
        session.send(f"G0X{at}\n", wait=False)
        # It stands a half step of its ramp after the last step.
        assert delay - 0.6 < off_after(session, pins) < 1.04 * delay + 5
        assert session.at(at, 0, 0)


def test_motors_are_off_in_a_hold_and_a_dwell_and_go_on_exactly(session, pins):
    session.send("$1=5\nG1X2F3000\nG4P0.1\nX0\n", wait=False)
    session.run(20 * MS)
    session.send("!", wait=False)
    off_after(session, pins)
    assert session.state()[0] == "Hold:0"
    stands = session.position[0]
    assert 0 < stands < 160
    session.send("~", wait=False)
    off_after(session, pins)
    assert session.at(2, 0, 0)
    session.send("")
    assert session.at(0, 0, 0)
    rises = [clock for clock, level in pins.changes["enable"] if level]
    assert len(rises) == 3
    assert all(min(abs(rise - at) for at, _ in session.path) < 10 * MS for rise in rises)


def test_motors_stay_on_in_a_homing_cycle_and_with_255(session):
    session.send("$1=1\n$22=1\n$25=60\n$132=2\n$H\n", wait=False)
    for _ in range(5):
        session.run(10 * MS)
        assert session.engine.get("enable") == 1
    session.send("\x18")
    assert session.send("$22=0\n$X\n") == ["ok", UNLOCKED, "ok"]
    session.run(5 * MS)
    assert session.engine.get("enable") == 0
    assert session.send("$1=255\nG91G0X0.1\n") == ["ok", "ok"]
    session.run(270 * MS)
    assert session.engine.get("enable") == 1
    assert session.send("$1=256\n") == ["error:38"]


def test_homing_stands_behind_each_of_its_motions(design):
    """It meets a switch twice, and pulls off as often, but behind the last time it is through."""
    with CXXRTLEngine(design) as engine:
        session = Switches(engine, (0.5, -0.5, 0.3))
        for line in [*HOMED, "$26=40"]:
            assert session.send(line + "\n") == ["ok"]
        session.path.clear()
        session.send("$H\n", wait=False, read=False)
        while not (answers := session.read()):
            session.run(2500)
            assert session.engine.clock < 40_000_000
        assert answers == ["ok"]
        times = [clock for clock, _ in session.path]
        gaps = [(after - before) / MS for before, after in zip(times, times[1:], strict=False)]
        assert sum(gap > 38 for gap in gaps) == 11
        assert max(gaps) < 70
        assert session.state() == ("Idle", [-0.4, -14.6, -0.4])
        assert not engine.get("fault")


def test_tolerance_of_arcs_is_kept_and_changes_nothing(session):
    assert session.send("$12=0.5\nG91G2X0Y0I1F6000\n") == ["ok", "ok"]
    path = [at for _, at in session.path]
    session.path.clear()
    assert session.send("$12=0\nG2X0Y0I1F6000\n") == ["ok", "ok"]
    assert [at for _, at in session.path] == path
    session.send("$$\n", read=False)
    session.run(400_000)
    assert "$12=0.000" in session.read()
