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
        ContactFilter(width=1, most=most)


@pytest.mark.parametrize("width", [0, 65])
def test_impossible_widths(width):
    with pytest.raises(ValueError, match="^width of a contact filter must be a whole number"):
        ContactFilter(width=width, most=15)


@pytest.mark.parametrize("period", [0, 1, 2, 7, 15])
def test_every_clock(period):
    """Up to a period a level does not pass; from one and a half on, and 6 clocks, it does."""
    rng = random.Random(period)
    inputs: list[list[int]] = [[], []]
    for levels in inputs:
        while len(levels) < 3000:
            levels += [rng.getrandbits(1)] * rng.choice(
                [1, 2, period, period + 1, 2 * period + 1, 2 * period + 7])
    clocks = min(map(len, inputs))
    rst = [int(rng.random() < 0.05) for _ in range(clocks)]
    both = [inputs[0][clock] | inputs[1][clock] << 1 for clock in range(clocks)]
    with AmaranthEngine(component("filter", ContactFilter(width=2, most=15))) as engine:
        seen = engine.apply({"i": both, "rst": rst, "period": [period] * clocks}, ["o"])
    interval, ticks = (period >> 1) + 2, range((period >> 1) + 1, clocks, (period >> 1) + 2)
    passed = 0
    for number, levels in enumerate(inputs):
        run, rose = 0, []
        for clock in range(clocks):
            on = int(seen["o"][clock]) >> number & 1
            assert run >= period + 4 if on else run < 3 * interval
            assert on == (sum(tick in ticks for tick in range(clock - run, clock)) >= 3)
            rose += [run] if on else []
            run = run + 1 if levels[clock] else 0
        passed += len(rose)
    assert passed > 20


def test_a_period_that_becomes_shorter_meanwhile():
    clocks = 60
    with AmaranthEngine(component("filter", ContactFilter(width=1, most=15))) as engine:
        seen = engine.apply({"i": [1] * clocks, "rst": [0] * clocks,
                             "period": [15] * 8 + [2] * (clocks - 8)}, ["o"])
    levels = [int(level) for level in seen["o"]]
    assert levels[45:] == [1] * 15
    assert levels == sorted(levels)
