"""Which lines reach the interpreter, and with which error; system lines: with all settings."""

import pytest

from fresa.protocol import SETTINGS
from tb.bench import Run
from tb.benches.gcode_gate import compare_lines

ACTIONS = {
    *(f"end {status}" for status in (0, 2, 3, 4, 5, 8, 9, 10, 12, 13, 14, 38)),
    "end 0 of a jog", "end 1 of a jog", "end 8 of a jog", "home 0", "home 1", "home 2", "home 3",
    "keep 2", "keep 3", "list HELP", "list MODES", "list COORDINATES", "list BUILD",
    "list STARTUP", "restart", "restored", "sleep", "texts", "unlock", "try 110=300000",
    "as before", "write 110=300000", "write 20=0", "erase 16", "erase 43", "show 22=1"}
"""Some of each kind."""


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 7))])
def test_every_line_does_what_its_model_says(seed):
    done = compare_lines(Run(), SETTINGS, seed, 150)
    assert {*done} >= ACTIONS
