# amaranth: UnusedElaboratable=no

"""Power of a spindle, its PWM, and pulses of a servo: against what they say, in numbers."""

import re

import pytest

from fresa.drive.spindle import FULL_POWER, LEAST_POWER, PowerPWM, ServoPulse, SpindlePower
from tb.boards import component
from tb.engines import AmaranthEngine


class TestSpindlePower:
    def test_is_off_a_clock_later_and_never_shows_what_was_before(self):
        with AmaranthEngine(component("power", SpindlePower())) as engine:
            engine.set(rst=0, on=1, speed=10**9, override=100, most=10**6)
            engine.run(130)
            assert engine.get("power") == FULL_POWER
            engine.set(on=0, speed=10**6)
            engine.run(1)
            assert engine.get("power") == 0
            engine.run(30)
            engine.set(on=1)
            seen = engine.apply({"on": [1] * 130}, ["power"])["power"]
            assert {int(level) for level in seen} == {0, LEAST_POWER}


@pytest.mark.parametrize(("kind", "parameters", "message"), [
    (PowerPWM, {"clock": 2_000_000, "frequency": 2000},
     "frequency of the PWM must be a whole number from 1 to 1953, not 2000"),
    (PowerPWM, {"clock": 50_000_000, "frequency": 0},
     "frequency of the PWM must be a whole number from 1 to 48828, not 0"),
    (PowerPWM, {"clock": 12, "frequency": 1, "phase_bits": 17},
     "phase_bits must be a whole number from 1 to 16, not 17"),
    (ServoPulse, {"clock": 2_000_000, "period": 17},
     "period must be a whole number from 18 to 20000, not 17"),
    (ServoPulse, {"clock": 999_999},
     "clock must be a whole number from 1000000 to 134217727, not 999999")])
def test_impossible_parameters(kind, parameters, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        kind(**parameters)


class TestPWM:
    @pytest.mark.parametrize("share", [0, 1, 64, 100, 512, 1023, 1024])
    def test_duty_and_frequency(self, share):
        clock, frequency = 3_000_000, 1000
        with AmaranthEngine(component("pwm", PowerPWM(clock=clock, frequency=frequency))) as engine:
            engine.set(rst=0, power=share << 6)
            engine.run(6000)
            seen = engine.apply({"power": [share << 6] * 12_000}, ["pin"])["pin"].astype(int)
        assert seen.sum() == pytest.approx(12_000 * share / 1024, abs=12)
        rises = ((seen[1:] == 1) & (seen[:-1] == 0)).nonzero()[0]
        if 0 < share < 1024:
            assert len(rises) == 4
            assert {*(rises[1:] - rises[:-1]).tolist()} <= {2999, 3000, 3001}

    def test_ends_at_once_and_changes_with_a_period(self):
        with AmaranthEngine(component("pwm", PowerPWM(clock=3_000_000, frequency=1000))) as engine:
            engine.set(rst=0, power=FULL_POWER)
            engine.run(7000)
            assert engine.get("pin")
            engine.set(power=0)
            engine.run(2)
            assert not engine.get("pin")
            engine.set(power=FULL_POWER)
            engine.run(2)
            assert not engine.get("pin")
            engine.run(3000)
            assert engine.get("pin")


@pytest.mark.parametrize(("low", "high", "shares", "period"), [
    (500, 2500, (30_000,), 20_000), (500, 2500, (0, FULL_POWER - 1, FULL_POWER), 3000),
    (2000, 1000, (1, 40_000), 3000), (30, 90, (0, 999, FULL_POWER), 100)])
def test_pulses_of_a_servo(low, high, shares, period):
    clock = 1_000_000
    with AmaranthEngine(component("servo", ServoPulse(clock=clock, period=period))) as engine:
        for share in shares:
            engine.set(rst=0, power=share, low=low, high=high)
            engine.run(2 * period)
            seen = engine.apply({"power": [share] * 2 * period}, ["pin"])["pin"].astype(int)
            rises = ((seen[1:] == 1) & (seen[:-1] == 0)).nonzero()[0]
            assert len(rises) == 2
            assert rises[1] - rises[0] == period
            assert seen.sum() == 2 * (low * (FULL_POWER - share) + high * share >> 16)


def test_a_servo_beats_twenty_times_a_period():
    with AmaranthEngine(component("servo", ServoPulse(clock=1_000_000))) as engine:
        engine.set(rst=0)
        seen = engine.apply({"power": [0] * 60_000}, ["beat"])["beat"].astype(int)
        beats = seen.nonzero()[0]
        assert len(beats) == 60
        assert {*(beats[1:] - beats[:-1]).tolist()} == {1024, 20_000 - 19 * 1024}


def test_pulse_of_a_servo_is_of_one_power():
    """One that falls from full power while the pulse is computed does not make it the shortest."""
    period = 40
    with AmaranthEngine(component("servo", ServoPulse(clock=1_000_000, period=period))) as engine:
        engine.set(rst=0, power=FULL_POWER, low=10, high=20)
        engine.run(period - 10)
        engine.set(power=FULL_POWER // 2)
        seen = engine.apply({"power": [FULL_POWER // 2] * 3 * period}, ["pin"])["pin"].astype(int)
        edges = (seen[1:] != seen[:-1]).nonzero()[0]
        assert list(edges[1::2] - edges[:-1:2]) == [20, 15, 15]
