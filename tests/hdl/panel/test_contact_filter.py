# amaranth: UnusedElaboratable=no

"""A level that must be steady for a time that is an input: every clock against what it says."""

import random
import re

import pytest

from fresa.panel import ContactFilter
from tb.boards import component
from tb.engines import AmaranthEngine


@pytest.mark.parametrize("most", [0, -1, 2**32 + 1, 1.0])
def test_impossible_times(most):
    message = f"longest time of a contact filter must be a whole number from 1 to {1 << 32}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}, not {re.escape(repr(most))}$"):
        ContactFilter(most=most)


@pytest.mark.parametrize("period", [0, 1, 2, 7, 15])
def test_every_clock(period):
    rng = random.Random(period)
    levels: list[int] = []
    while len(levels) < 1000:
        levels += [rng.getrandbits(1)] * rng.choice([1, 2, period, period + 1, 2 * period + 1])
    rst = [int(rng.random() < 0.05) for _ in levels]
    with AmaranthEngine(component("filter", ContactFilter(most=15))) as engine:
        seen = engine.apply({"i": levels, "rst": rst, "period": [period] * len(levels)}, ["o"])
    steady = max(1, period)
    assert [int(level) for level in seen["o"]] == [
        int(clock >= steady and all(levels[clock - steady:clock])) for clock in range(len(levels))]


def test_a_period_that_becomes_shorter_meanwhile():
    clocks = 40
    with AmaranthEngine(component("filter", ContactFilter(most=15))) as engine:
        seen = engine.apply({"i": [1] * clocks, "rst": [0] * clocks,
                             "period": [15] * 10 + [5] * (clocks - 10)}, ["o"])
    levels = [int(level) for level in seen["o"]]
    assert levels[30:] == [1] * 10
    assert levels == sorted(levels)
