"""Which lines reach the interpreter, and with which error; system lines: with all settings."""

import pytest

from fresa.protocol import SETTINGS
from tb.bench import Run
from tb.benches.gcode_gate import converse


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 7))])
def test_every_line_does_what_its_model_says(seed):
    ends = converse(Run(), SETTINGS, seed, 100)
    assert {"end 0", "end 3", "end 8"} <= {*ends}
