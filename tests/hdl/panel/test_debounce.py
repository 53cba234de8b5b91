# amaranth: UnusedElaboratable=no

"""Contacts that bounce."""

import random
import re
from itertools import pairwise

import pytest

from fresa.panel import Debouncer, debounce_period
from fresa.panel.debounce import DEBOUNCE
from tb.boards import component
from tb.engines import AmaranthEngine


def run(levels, period, *, width=1, rst=None):
    with AmaranthEngine(component("debouncer", Debouncer(width=width, period=period))) as engine:
        rst = [0] * len(levels) if rst is None else rst
        return engine.apply({"i": levels, "rst": rst}, ["o"])["o"].tolist()


@pytest.mark.parametrize("period", [1, 2, 3, 7, 8])
class TestDebouncer:
    @pytest.mark.parametrize("rest", [0, 1])
    def test_a_short_disturbance_never_passes(self, period, rest):
        """At every place in the period, for every time that is shorter."""
        for at in range(period):
            for length in range(period):
                levels = [rest] * (3 * period + at) + [1 - rest] * length + [rest] * 3 * period
                assert run(levels, period)[2 * period + 1 :] == [rest] * (
                    len(levels) - 2 * period - 1
                )

    @pytest.mark.parametrize("rest", [0, 1])
    def test_a_level_held_for_two_periods_always_passes(self, period, rest):
        for at in range(period):
            levels = [rest] * (3 * period + at) + [1 - rest] * (2 * period + 1)
            assert run(levels, period)[-1] == 1 - rest

    def test_bounces_make_one_edge(self, period):
        rng = random.Random(period)
        for _ in range(20):
            bounce = [rng.randrange(2) for _ in range(rng.randrange(1, 4 * period))]
            levels = [0] * 2 * period + bounce + [1] * 3 * period
            seen = run(levels, period)
            held = len(levels) - 3 * period
            if period > 1 and not any(
                all(bounce[n : n + period]) for n in range(len(bounce) - period + 1)
            ):
                assert sum(a != b for a, b in pairwise(seen)) == 1
            assert seen[-1] == 1
            assert seen[held + 2 * period :] == [1] * period

    def test_inputs_do_not_meet(self, period):
        rng = random.Random(period)
        levels = []
        for _ in range(60):
            levels += [rng.randrange(8)] * rng.randrange(1, 3 * period + 1)
        together = run(levels, period, width=3)
        for bit in range(3):
            alone = run([level >> bit & 1 for level in levels], period)
            assert [seen >> bit & 1 for seen in together] == alone

    def test_lives_through_reset(self, period):
        """Its own button lets go of reset, so reset must stop neither the levels nor the time."""
        settled = [1] * 3 * period
        levels = settled + [1] * period + [0] * 3 * period
        rst = [0] * len(settled) + [1] * (len(levels) - len(settled))
        seen = run(levels, period, rst=rst)
        assert seen[len(settled) : len(settled) + period] == [1] * period
        assert seen[-1] == 0


class TestParameters:
    @pytest.mark.parametrize("period", [0, -1, 2**26 + 1, 1.0])
    def test_impossible_periods(self, period):
        message = f"debounce period must be a whole number from 1 to 67108864, not {period!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Debouncer(width=1, period=period)

    def test_power_up(self):
        with AmaranthEngine(component("debouncer", Debouncer(width=5, period=3))) as engine:
            assert engine.get("o") == 0


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
