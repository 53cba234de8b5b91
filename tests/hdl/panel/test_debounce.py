# amaranth: UnusedElaboratable=no

"""Contacts that bounce."""

import random
from itertools import pairwise

import pytest

from fresa.panel import Debouncer, debounce_period
from fresa.panel.debounce import DEBOUNCE
from tb.boards import component
from tb.engines import AmaranthEngine


@pytest.mark.parametrize("period", [1, 2, 7])
def test_bounces_make_one_edge(period):
    rng = random.Random(period)
    for _ in range(20):
        bounce = [rng.randrange(2) for _ in range(rng.randrange(1, 4 * period))]
        levels = [0] * 2 * period + bounce + [1] * 3 * period
        with AmaranthEngine(component("debouncer", Debouncer(width=1, period=period))) as engine:
            seen = engine.apply({"i": levels}, ["o"])["o"].tolist()
        if period > 1 and not any(
                all(bounce[n:n + period]) for n in range(len(bounce) - period + 1)):
            assert sum(a != b for a, b in pairwise(seen)) == 1
        assert seen[-period:] == [1] * period


class TestDebouncePeriod:
    @pytest.mark.parametrize("clock", [50_000_000, 12_000_000])
    def test_default(self, clock):
        assert debounce_period(clock) == clock * DEBOUNCE == clock // 100

    @pytest.mark.parametrize(
        ("seconds", "clock", "clocks"),
        [(0.001, 100, 1), (0.015, 100, 2), (1, 100, 100), (0.5, 3, 2)],
    )
    def test_one_more_rather_than_one_less(self, seconds, clock, clocks):
        assert debounce_period(clock, seconds) == clocks

    @pytest.mark.parametrize("seconds", [0, -1, 100])
    def test_impossible_time(self, seconds):
        with pytest.raises(ValueError, match=rf"^debounce time must be .*, not {seconds}$"):
            debounce_period(50_000_000, seconds)
