# amaranth: UnusedElaboratable=no

"""A level that must be steady before it acts."""

import random
import re

import pytest

from fresa.panel import GlitchFilter
from tb.boards import component
from tb.engines import AmaranthEngine


def run(levels, period, rst=None):
    with AmaranthEngine(component("filter", GlitchFilter(period=period))) as engine:
        rst = [0] * len(levels) if rst is None else rst
        return engine.apply({"i": levels, "rst": rst}, ["o"])["o"].tolist()


@pytest.mark.parametrize("period", [1, 2, 3, 8])
def test_is_high_after_as_many_clocks_and_never_sooner(period):
    """Levels and resets at random."""
    rng = random.Random(period)
    levels = [level for _ in range(60) for level in
              [rng.randrange(2)] * rng.randrange(1, 2 * period + 2)]
    seen = run(levels, period, [rng.randrange(2) for _ in levels])
    assert seen == [int(at >= period and all(levels[at - period:at])) for at in range(len(levels))]
    assert {*seen} == {0, 1}


@pytest.mark.parametrize("period", [0, -1, 2**26 + 1, 1.0])
def test_impossible_periods(period):
    message = f"filter period must be a whole number from 1 to 67108864, not {period!r}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        GlitchFilter(period=period)
