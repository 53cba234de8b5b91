# amaranth: UnusedElaboratable=no

"""The divider, against a count of enabled clocks."""

import random

import pytest

from fresa.drive import MAX_PERIOD, FrequencyDivider, valid_period
from tb.boards import component
from tb.engines import AmaranthEngine


def ticks(period, enable, clear, rst):
    """Ticks of each clock: those counted since the last tick, clear or reset."""
    counted = 0
    for en, zero, reset in zip(enable, clear, rst, strict=True):
        tick = bool(en) and counted + 1 == period
        yield int(tick)
        counted = 0 if tick or zero or reset else counted + en


class TestFrequencyDivider:
    @pytest.mark.parametrize("period", [1, 2, 3, 4, 5, 8, 9])
    def test_ticks(self, period):
        rng = random.Random(period)
        length = 800
        played = {
            "enable": [1] * 3 * period + [int(rng.random() < 0.8) for _ in range(length)],
            "clear": [0] * 3 * period + [int(rng.random() < 0.05) for _ in range(length)],
            "rst": [0] * 3 * period + [int(rng.random() < 0.02) for _ in range(length)],
        }
        with AmaranthEngine(component("divider", FrequencyDivider(period=period))) as engine:
            seen = engine.apply(played, ["tick"])["tick"].tolist()
        assert seen == list(ticks(period, played["enable"], played["clear"], played["rst"]))

    def test_periods_of_the_machines(self):
        for period in (1, 493_214, MAX_PERIOD):
            assert FrequencyDivider(period=period).period == valid_period(period) == period
        with pytest.raises(ValueError, match=r"^jog_period must be .*, not 0$"):
            valid_period(0, name="jog_period")
