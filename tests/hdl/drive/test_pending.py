# amaranth: UnusedElaboratable=no

"""Pending steps: as their model in every clock, and in front of a driver."""

import random
import re

import pytest

from fresa.drive import PendingSteps
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.drive import StepDirModel
from tb.models.walk import PendingModel

OUTPUTS = ("driver_step", "driver_direction", "pending", "fault")


@pytest.mark.parametrize(("width", "eager"), [(2, 0.5), (3, 0.3), (4, 0.2)])
def test_is_its_model_in_every_clock(width, eager):
    rng, model = random.Random(width), PendingModel(width)
    seen = set()
    with AmaranthEngine(component("pending", PendingSteps(width=width))) as engine:
        for clock in range(1500):
            way = rng.random() < 0.5 + 0.4 * (clock // 100 % 3 - 1)
            pins = {"step": int(rng.random() < 0.5), "direction": int(way),
                    "moved": int(engine.get("driver_step") and rng.random() < eager),
                    "rst": int(rng.random() < 0.01)}
            engine.set(**pins)
            outputs = dict(zip(OUTPUTS, engine.get(*OUTPUTS), strict=True))
            assert outputs == model.clock(**pins), clock
            seen.add((outputs["pending"], outputs["fault"]))
            engine.run(1)
    assert len(seen) > 1 << width


def test_a_driver_makes_what_was_requested_however_fast_it_turns():
    """Its pulses are slower than requests, and its turns take time: none is lost."""
    rng, driver = random.Random(1), StepDirModel(width=3, low=3, setup=5, hold=2)
    wanted = made = 0
    with AmaranthEngine(component("pending", PendingSteps(width=4))) as engine:
        for clock in range(3000):
            step, direction = engine.get("driver_step", "driver_direction")
            pins = driver.clock(step=step, direction=direction, enable=1)
            request = int(clock % 8 == 0 and clock < 2900)
            way = clock // 80 % 2 if clock < 1500 else rng.randrange(2)
            engine.set(step=request, direction=way, moved=pins["moved"])
            wanted += request and (1 if way else -1)
            made += pins["moved"] and (1 if direction else -1)
            engine.run(1)
        assert engine.get("pending", "fault") == (0, 0)
    assert made == wanted


@pytest.mark.parametrize("width", [1, 33, "4"])
def test_impossible(width):
    message = f"width must be a whole number from 2 to 32, not {width!r}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        PendingSteps(width=width)
