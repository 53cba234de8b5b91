# amaranth: UnusedElaboratable=no

"""STEP, DIR and ENABLE: against a model, and with a ruler on the pins."""

import random
import re
from itertools import pairwise

import numpy as np
import pytest

from fresa.drive import MAX_PULSE, StepDirDriver
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
    @pytest.mark.parametrize("given", TIMES)
    @pytest.mark.parametrize("seed", range(3))
    def test_is_its_model_in_every_clock(self, given, seed):
        stimulus = bursts(INPUTS, seed, sum(given), 3000)
        with driver(**times(*given)) as engine:
            seen = engine.apply(stimulus, OUTPUTS)
        expected = played(StepDirModel(**times(*given)).clock, stimulus)
        assert {name: values.tolist() for name, values in seen.items()} == expected
        assert measure(seen, **times(*given)) > 20

    @pytest.mark.parametrize("given", TIMES)
    def test_in_one_direction_pulses_are_as_close_as_may_be(self, given):
        width, low, setup, hold = given
        clocks = max(given) + setup + 10 * (width + max(low, hold))
        with driver(**times(*given)) as engine:
            engine.set(step=1, direction=1, enable=1)
            seen = engine.apply({"rst": [0] * clocks}, OUTPUTS)
        assert measure(seen, **times(*given)) >= 10
        rises = np.flatnonzero(seen["moved"])
        assert set(np.diff(rises)) == {width + max(low, hold)}

    @pytest.mark.parametrize("change", ["step", "direction", "enable", "rst"])
    def test_a_pulse_is_never_cut(self, change):
        """Whatever changes, in whichever clock of it."""
        for clock in range(30):
            with driver(**times(5, 6, 3, 4)) as engine:
                engine.set(step=1, direction=1, enable=1)
                before = engine.apply({"rst": [0] * (40 + clock)}, OUTPUTS)
                engine.set(**{change: 1 if change == "rst" else 0})
                after = engine.apply({"direction": [int(change != "direction")] * 60}, OUTPUTS)
            whole = {name: np.concatenate([before[name], after[name]]) for name in OUTPUTS}
            made = measure(whole, **times(5, 6, 3, 4))
            assert made == whole["moved"][:-1].sum()
            if change != "direction":
                assert not whole["moved"][40 + clock :].any()

    def test_the_step_that_is_taken_back_is_not_made(self):
        """While DIR settles for it, or a pulse is over: nothing was counted, nothing comes."""
        rng = random.Random(3)
        with driver(**times(3, 3, 8, 3)) as engine:
            engine.set(enable=1)
            engine.run(20)
            for direction in (1, 0, 1, 0):
                engine.set(direction=direction, step=1)
                engine.run(rng.randrange(1, 8))
                engine.set(step=0)
                seen = engine.apply({"rst": [0] * 30}, OUTPUTS)
                assert not seen["moved"].any() and not seen["step_pin"].any()
                assert engine.get("direction_pin") == direction

    def test_a_direction_without_a_step_turns_nothing(self):
        with driver(**times(2, 2, 2, 2)) as engine:
            engine.set(enable=1)
            seen = engine.apply({"direction": [0, 1] * 20}, PINS)
        assert not seen["direction_pin"].any() and not seen["step_pin"].any()

    def test_pulses_of_a_real_module(self):
        """DRV8825 at 50 MHz, reversed at any time: 1.9 us high and low, 650 ns before and after."""
        real = times(95, 95, 33, 33)
        rng = random.Random(8)
        direction = [way for _ in range(40) for way in [rng.randrange(2)] * rng.randrange(1, 900)]
        with driver(**real) as engine:
            engine.set(step=1, enable=1)
            seen = engine.apply({"direction": direction}, OUTPUTS)
        assert measure(seen, **real) > 40
        assert min(b - a for a, b in pairwise(np.flatnonzero(seen["moved"]))) == 190


class TestParameters:
    @pytest.mark.parametrize("name", ["width", "low", "setup", "hold"])
    @pytest.mark.parametrize("value", [0, -1, MAX_PULSE + 1, 1.9e-6])
    def test_impossible_times(self, name, value):
        message = f"{name} must be a whole number from 1 to 65536, not {value!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            StepDirDriver(**{**times(1, 1, 1, 1), name: value})
