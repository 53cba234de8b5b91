# amaranth: UnusedElaboratable=no

"""Jog switches."""

import random

import pytest

from fresa.motion import ManualControl
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ["step", "direction", "active"]


def run(period=1, **played):
    with AmaranthEngine(component("manual", ManualControl(period=period))) as engine:
        return {name: row.tolist() for name, row in engine.apply(played, OUTPUTS).items()}


def wanted(jog: int) -> tuple[int, int]:
    """Axes that move, and those of them that go up: both on means up."""
    axes = [(jog >> 2 * n & 1, jog >> 2 * n + 1 & 1) for n in range(3)]
    return (
        sum(bool(up or down) << n for n, (up, down) in enumerate(axes)),
        sum(up << n for n, (up, _) in enumerate(axes)),
    )


class TestManualControl:
    def test_every_combination(self):
        jog = [0, *range(64)]
        seen = run(enable=[1] * 65, jog=jog)
        for clock in range(1, 65):
            active, up = wanted(jog[clock])
            assert (seen["active"][clock], seen["step"][clock]) == (active, active)
            assert seen["direction"][clock] & active == up

    @pytest.mark.parametrize("mask", [0b000001, 0b000010, 0b110000, 0b111111])
    def test_a_switch_on_at_entry_waits_until_it_has_been_off(self, mask):
        jog = [mask] * 10 + [0] + [mask] * 5
        for lead in (0, 3):  # on before manual mode, or from reset
            seen = run(enable=[0] * lead + [1] * (len(jog) - lead), jog=jog)
            assert seen["step"][:11] == [0] * 11
            assert seen["step"][11:] == [wanted(mask)[0]] * 5

    def test_other_switches_do_not_wait_for_it(self):
        seen = run(enable=[1] * 6, jog=[0b01, 0b01, 0b0101, 0b0101, 0b0111, 0b0100])
        assert seen["step"] == [0, 0, 0b10, 0b10, 0b11, 0b10]
        assert seen["direction"][4] == 0b10  # X up is still waiting: down alone counts

    def test_leaving_manual_mode_makes_them_wait_again(self):
        seen = run(enable=[1, 1, 0, 1, 1, 1], jog=[0, 1, 1, 1, 0, 1])
        assert seen["step"] == [0, 1, 0, 0, 0, 1]

    def test_nothing_in_automatic_mode(self):
        rng = random.Random(0)
        seen = run(enable=[0] * 100, jog=[rng.randrange(64) for _ in range(100)])
        assert not any(seen["step"]) and not any(seen["active"])

    def test_reset_makes_them_wait(self):
        seen = run(enable=[1] * 6, jog=[0, 1, 1, 1, 0, 1], rst=[0, 0, 1, 0, 0, 0])
        assert seen["step"][3:] == [0, 0, 1]

    @pytest.mark.parametrize("period", [2, 5])
    def test_rate(self, period):
        seen = run(period, enable=[1] * 40, jog=[0, 0] + [0b100] * 38)
        asked = [clock for clock, step in enumerate(seen["step"]) if step]
        assert asked == list(range(1 + period, 40, period))

    @pytest.mark.parametrize("period", [0, 2**26 + 1])
    def test_impossible_periods(self, period):
        with pytest.raises(ValueError, match=rf"^jog_period must be .*, not {period}$"):
            ManualControl(period=period)
