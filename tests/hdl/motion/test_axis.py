# amaranth: UnusedElaboratable=no

"""A whole axis, from a target to the pins: what the motor and its load really do."""

import gc
import random

import numpy as np
import pytest

from fresa.drive import HALF_STEP, PhaseDriver, StepDirDriver
from fresa.motion import Axis
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.motion import AxisModel
from tb.stimulus import bursts

MODULUS, FASTEST, PLAY, WIDTH = 240, 20, 5, 8
SPACING = MODULUS // FASTEST
OUTPUTS = ["position", "in_position", "moved", "limit_hit", "step_pin", "direction_pin",
           "enable_pin"]
TIMES = {"width": 3, "low": 4, "setup": 2, "hold": 2}


def axis(driver: PhaseDriver | StepDirDriver) -> AmaranthEngine:
    return AmaranthEngine(component("axis", Axis(
        driver=driver, modulus=MODULUS, max_rate=FASTEST, max_backlash=PLAY,
        width=WIDTH)))


def module() -> StepDirDriver:
    return StepDirDriver(width=3, low=4, setup=2, hold=2)


def stimulus(seed: int, clocks: int, backlash: int) -> dict[str, list[int]]:
    """Change each input when it likes, often in the middle of a pulse."""
    rng = random.Random(seed)
    choices = {"target_n": lambda: rng.randrange(-30, 30) % (1 << WIDTH),
               "run": lambda: rng.random() < 0.9, "rate": lambda: rng.choice([0, 3, 19, 20, 31]),
               "enable": lambda: rng.random() < 0.9, "low": lambda: rng.random() < 0.2,
               "high": lambda: rng.random() < 0.2}
    rows: dict[str, list[int]] = {"backlash": [backlash] * clocks}
    for name, choose in choices.items():
        made: list[int] = []
        while len(made) < clocks:
            made += [int(choose())] * rng.randrange(1, 300)
        rows[name] = made[:clocks]
    return rows


def signed(values) -> np.ndarray:
    return (np.asarray(values) + (1 << WIDTH - 1)) % (1 << WIDTH) - (1 << WIDTH - 1)


def load_of(motor, backlash: int) -> list[int]:
    """Follow a motor with a load that has backlash, and lies where a movement down leaves it."""
    at, places = 0, []
    for place in motor:
        at = min(max(at, place - backlash), place)
        places.append(at)
    return places


class TestAxis:
    @pytest.mark.parametrize("seed", range(2))
    def test_is_its_model_in_every_clock(self, seed):
        chance = bursts({"load": [1], "place": [WIDTH], "rst": [1], "backlash": [3]}, seed, 0, 8000)
        rare = np.arange(8000) % 97 == 0
        given = {**stimulus(seed, 8000, 0), "backlash": chance["backlash"],
                 "place": chance["place"],
                 "load": chance["load"] & rare, "rst": chance["rst"] & rare}
        with axis(module()) as engine:
            seen = engine.apply(given, OUTPUTS)
        given = {name: np.asarray(row).astype(int) for name, row in given.items()}
        given |= {"target": signed(~given.pop("target_n")), "place": signed(given["place"])}
        model = AxisModel(times=TIMES, modulus=MODULUS, max_rate=FASTEST)
        seen["position"] = signed(seen["position"])
        assert {name: values.tolist() for name, values in seen.items()} == played(
            model.clock, given)
        assert seen["moved"].sum() > 100 and seen["limit_hit"].any()

    @pytest.mark.parametrize("backlash", [0, 1, 5])
    @pytest.mark.parametrize("seed", range(2))
    def test_the_position_is_where_pulses_took_the_load(self, seed, backlash):
        given = stimulus(seed, 6000, backlash)
        with axis(module()) as engine:
            seen = engine.apply(given, ["position", "moved", "step_pin", "direction_pin",
                                       "enable_pin"])
        rises = np.diff(seen["step_pin"], prepend=0) == 1
        assert rises.sum() > 100 and seen["enable_pin"][rises].all()
        way = np.where(seen["direction_pin"] == 1, 1, -1)
        motor = np.cumsum(np.where(rises, way, 0))
        assert signed(seen["position"]).tolist() == load_of(motor, backlash)
        clocks = np.flatnonzero(rises)
        assert np.diff(clocks).min() == SPACING
        # A switch that is on in the clock before the edge stops it.
        for clock in clocks:
            towards = given["high"] if way[clock] == 1 else given["low"]
            assert not towards[clock - 1]

    @pytest.mark.parametrize("seed", range(2))
    def test_coils_take_the_load_there_as_well(self, seed):
        given = stimulus(seed, 6000, 3)
        driver = PhaseDriver(sequence=HALF_STEP, period=4)
        with axis(driver) as engine:
            seen = engine.apply(given, ["position", "moved", "coils"])
        # The rotor stays where it is without power, and never has to jump.
        words = [word for word in seen["coils"].tolist() if word]
        turns = [(HALF_STEP.index(b) - HALF_STEP.index(a) + 3) % 8 - 3
                 for a, b in zip([HALF_STEP[0], *words], words, strict=False)]
        assert set(turns) == {-1, 0, 1}
        on = seen["coils"] != 0
        motor = np.cumsum(turns)
        assert signed(seen["position"])[on].tolist() == load_of(motor, 3)
        assert np.diff(np.flatnonzero(seen["moved"])).min() == SPACING


class TestParameters:
    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    @pytest.mark.parametrize(("name", "value", "expected"), [
        ("width", 1, "width must be a whole number from 2 to 64, not 1"),
        ("modulus", 0, "modulus must be a whole number from 1 to 1099511627776, not 0"),
        ("max_rate", 241, "max_rate must be a whole number from 1 to 240, not 241"),
        ("max_backlash", 0, "max_backlash must be a whole number from 1 to 1048576, not 0"),
    ])
    def test_impossible(self, name, value, expected):
        good = {"modulus": MODULUS, "max_rate": FASTEST, "max_backlash": PLAY, "width": 8}
        message = None
        try:  # what was made before the refusal is let go of here, not later
            Axis(driver=module(), **{**good, name: value})
        except ValueError as error:
            message = str(error)
        gc.collect()
        assert message == expected
