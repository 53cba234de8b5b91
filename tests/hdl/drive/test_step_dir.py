# amaranth: UnusedElaboratable=no

"""STEP, DIR and ENABLE: against a model, and with a ruler on the pins."""

import numpy as np
import pytest

from fresa.drive import StepDirDriver
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.drive import StepDirModel
from tb.stimulus import bursts

PINS = ["step_pin", "direction_pin", "enable_pin"]
OUTPUTS = ["ready", "moved", *PINS]
INPUTS = {"step": [1], "direction": [1], "enable": [1], "rst": [1]}
TIMES = [(1, 1, 1, 1), (2, 3, 3, 2), (3, 2, 1, 4), (1, 5, 2, 1), (4, 1, 7, 3), (10, 10, 4, 4)]


def times(width: int, low: int, setup: int, hold: int) -> dict[str, int]:
    return {"width": width, "low": low, "setup": setup, "hold": hold}


def driver(**parameters) -> AmaranthEngine:
    return AmaranthEngine(component("step_dir", StepDirDriver(**parameters)))


def measure(seen, *, width: int, low: int, setup: int, hold: int) -> int:
    """Lay a ruler on the pins as a driver module sees them; return how many pulses it got."""
    step = np.concatenate([[0], seen["step_pin"]])
    rises = np.flatnonzero(np.diff(step) == 1)
    falls = np.flatnonzero(np.diff(step) == -1)
    assert (falls - rises[: len(falls)] == width).all()
    assert (rises[1:] - falls[: len(rises) - 1] >= low).all()
    for name in ("direction_pin", "enable_pin"):
        for change in np.flatnonzero(np.diff(seen[name])) + 1:
            assert not seen["step_pin"][change - 1 : change + 1].any()
            assert not falls[falls < change].size or change - falls[falls < change].max() >= hold
            assert not rises[rises >= change].size or rises[rises >= change].min() - change >= setup
    assert seen["enable_pin"][rises].all()
    # Each is counted in the clock before it rises, and no other is.
    moved = np.flatnonzero(seen["moved"]) + 1
    assert [clock for clock in moved if clock < len(seen["moved"])] == rises.tolist()
    return len(rises)


class TestStepDirDriver:
    @pytest.mark.parametrize("given", [(1, 1, 1, 1), (3, 2, 1, 4), (10, 10, 4, 4)])
    def test_each_pulse_lasts_as_long_as_was_wanted_with_its_step(self, given):
        stimulus = bursts(INPUTS, 5, sum(given), 3000)
        rng = np.random.default_rng(5)
        stimulus["width_now"] = rng.integers(1, given[0] + 1, 3000).tolist()
        with driver(**times(*given), adjustable=True) as engine:
            seen = engine.apply(stimulus, OUTPUTS)
        expected = played(StepDirModel(**times(*given)).clock, stimulus)
        assert {name: values.tolist() for name, values in seen.items()} == expected

    @pytest.mark.parametrize("given", TIMES)
    @pytest.mark.parametrize("seed", range(2))
    def test_is_its_model_in_every_clock(self, given, seed):
        stimulus = bursts(INPUTS, seed, sum(given), 3000)
        with driver(**times(*given)) as engine:
            seen = engine.apply(stimulus, OUTPUTS)
        expected = played(StepDirModel(**times(*given)).clock, stimulus)
        assert {name: values.tolist() for name, values in seen.items()} == expected
        assert measure(seen, **times(*given)) > 20
