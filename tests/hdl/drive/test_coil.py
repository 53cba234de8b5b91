# amaranth: UnusedElaboratable=no

"""One motor: the table of its maker, and the time that a step takes."""

import random

import pytest

from fresa.drive import FULL_STEP, CoilDriver
from tb.boards import component
from tb.engines import AmaranthEngine

#: Black, orange, brown, yellow.
TABLE = ["-++-", "--++", "+--+", "++--"]
WORDS = [int(row.replace("+", "1").replace("-", "0"), 2) for row in TABLE]
OUTPUTS = ["coils", "moved", "refused"]


def driver(period: int) -> AmaranthEngine:
    return AmaranthEngine(component("coil", CoilDriver(period=period)))


class TestCoilDriver:
    def test_table(self):
        assert list(FULL_STEP) == WORDS

    @pytest.mark.parametrize("period", [1, 2, 3, 5, 8])
    def test_a_step_is_made_or_refused(self, period):
        """Reset neither makes a step nor forgets when the last one was made."""
        rng = random.Random(period)
        length = 1500
        played = {
            name: [int(rng.random() < share) for _ in range(length)]
            for name, share in [("step", 0.7), ("direction", 0.5), ("rst", 0.1)]
        }
        with driver(period) as engine:
            seen = engine.apply(played, OUTPUTS)
        state, last = 0, -period
        for clock in range(length):
            step, direction, rst = (played[name][clock] for name in ("step", "direction", "rst"))
            made = step and not rst and clock - last >= period
            assert seen["coils"][clock] == WORDS[state]
            assert seen["moved"][clock] == bool(made)
            assert seen["refused"][clock] == bool(step and not made)
            if made:
                state, last = (state + (1 if direction else -1)) % 4, clock
