# amaranth: UnusedElaboratable=no

"""Two driver modules: as one while no motor is halted, and in any case each step at both or one."""

import re
from typing import Any

import numpy as np
import pytest

from fresa.drive import StepDirPair
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.drive import StepDirModel
from tb.stimulus import bursts

INPUTS = {"step": [1], "direction": [1], "enable": [1], "rst": [1]}
OUTPUTS = ["moved", "step_pin", "direction_pin", "enable_pin", "second_step_pin",
           "second_direction_pin"]
TIMES = [(1, 1, 1, 1), (2, 3, 3, 2), (1, 5, 2, 1), (4, 1, 7, 3)]


def times(width: int, low: int, setup: int, hold: int) -> dict[str, Any]:
    return {"width": width, "low": low, "setup": setup, "hold": hold}


def pair(given: tuple[int, ...]) -> AmaranthEngine:
    return AmaranthEngine(component("step_dir_pair", StepDirPair(**times(*given))))


def rises(pin: np.ndarray) -> np.ndarray:
    return np.diff(pin.astype(np.int8), prepend=0) == 1


@pytest.mark.parametrize("given", TIMES)
def test_while_no_motor_is_halted_both_are_as_a_driver_in_every_clock(given):
    stimulus = bursts(INPUTS, 1, sum(given), 3000)
    with pair(given) as engine:
        seen = engine.apply(stimulus, OUTPUTS)
    expected = played(StepDirModel(**times(*given)).clock, stimulus)
    for name in ("moved", "step_pin", "direction_pin", "enable_pin"):
        assert seen[name].tolist() == expected[name]
    for name in ("step_pin", "direction_pin"):
        assert (seen[f"second_{name}"] == seen[name]).all()
    assert rises(seen["step_pin"]).sum() > 20


def test_pulses_of_both_last_as_long_as_is_wanted():
    stimulus = {**bursts(INPUTS, 1, 12, 3000), "width_now": [1 + n // 200 % 4 for n in range(3000)]}
    dut = StepDirPair(**times(4, 3, 2, 2), adjustable=True)
    with AmaranthEngine(component("step_dir_pair", dut)) as engine:
        seen = engine.apply(stimulus, OUTPUTS)
    expected = played(StepDirModel(**times(4, 3, 2, 2)).clock, stimulus)
    assert seen["step_pin"].tolist() == expected["step_pin"]
    assert (seen["second_step_pin"] == seen["step_pin"]).all()


@pytest.mark.parametrize("given", TIMES)
def test_each_step_is_made_by_the_motors_that_are_not_halted(given):
    stimulus = bursts({**INPUTS, "halt": [1, 1]}, 2, sum(given), 6000)
    with pair(given) as engine:
        seen = engine.apply(stimulus, OUTPUTS)
    moved, halt = seen["moved"][:-1].astype(bool), np.asarray(stimulus["halt"])[:-1]
    assert not moved[halt == 3].any()
    counts = []
    for motor, name in enumerate(("step_pin", "second_step_pin")):
        made = rises(seen[name])[1:]
        assert (made == (moved & (halt >> motor & 1 == 0))).all()
        counts.append(made.sum())
    assert min(counts) > 20 and counts[0] != counts[1]


def test_behind_a_halt_the_other_motor_is_waited_for():
    """The first motor has just made a step alone; the next is one of both, when it may be."""
    with pair((4, 6, 2, 2)) as engine:
        engine.set(enable=1, direction=1, step=1, halt=2)
        while not engine.get("moved"):
            engine.run(1)
        engine.run(1)
        engine.set(halt=0)
        for _ in range(9):
            assert not engine.get("moved") and not engine.get("second_step_pin")
            engine.run(1)
        assert engine.get("moved")
        engine.run(1)
        assert engine.get("step_pin", "second_step_pin") == (1, 1)


def test_impossible():
    message = "low must be a whole number from 1 to 65536, not 0"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        StepDirPair(**times(1, 0, 1, 1))
