# amaranth: UnusedElaboratable=no

"""A whole axis, from a target to the pins: what the motor and its load really do."""

import random

import numpy as np
import pytest
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.drive import HALF_STEP, PhaseDriver, RateGenerator, StepDirDriver
from fresa.motion import Backlash, Limits, MoveTo
from tb.boards import component
from tb.engines import AmaranthEngine

MODULUS, FASTEST, PLAY, WIDTH = 240, 20, 5, 8
SPACING = MODULUS // FASTEST
INPUTS = {"target": In(WIDTH), "run": In(1), "rate": In(range(FASTEST + 1)), "enable": In(1),
          "low": In(1), "high": In(1), "play": In(range(PLAY + 1))}


class Axis(wiring.Component):
    """Everything that an axis is made of, and its driver."""

    def __init__(self, driver: PhaseDriver | StepDirDriver) -> None:
        self.driver = driver
        pins = {name: Out(member.shape) for name, member in driver.signature.members.items()
                if name.endswith("_pin") or name == "coils"}
        super().__init__(INPUTS | pins | {"position": Out(WIDTH), "moved": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.move = move = MoveTo(width=WIDTH)
        m.submodules.backlash = backlash = Backlash(max_play=PLAY)
        m.submodules.limits = limits = Limits(axes=1, period=3)
        m.submodules.rate = rate = RateGenerator(modulus=MODULUS, max_rate=FASTEST)
        m.submodules.driver = driver = self.driver
        m.d.comb += [
            move.target.eq(self.target), move.run.eq(self.run), move.moved.eq(backlash.counted),
            backlash.play.eq(self.play), backlash.direction.eq(move.direction),
            limits.low.eq(self.low), limits.high.eq(self.high),
            limits.direction.eq(move.direction), limits.step.eq(move.step & rate.due),
            rate.rate.eq(self.rate),
            driver.step.eq(limits.allowed), driver.direction.eq(move.direction),
            driver.enable.eq(self.enable),
            *(part.moved.eq(driver.moved) for part in (backlash, rate)),
            self.position.eq(move.position), self.moved.eq(driver.moved),
            *(getattr(self, name).eq(getattr(driver, name)) for name in self.signature.members
              if name.endswith("_pin") or name == "coils"),
        ]

        return m


def module() -> StepDirDriver:
    return StepDirDriver(width=3, low=4, setup=2, hold=2)


def stimulus(seed: int, clocks: int, play: int) -> dict[str, list[int]]:
    """Change each input when it likes, often in the middle of a pulse."""
    rng = random.Random(seed)
    choices = {"target": lambda: rng.randrange(-30, 30) % (1 << WIDTH),
               "run": lambda: rng.random() < 0.9, "rate": lambda: rng.choice([0, 3, 19, 20, 31]),
               "enable": lambda: rng.random() < 0.9, "low": lambda: rng.random() < 0.2,
               "high": lambda: rng.random() < 0.2}
    rows: dict[str, list[int]] = {"play": [play] * clocks}
    for name, choose in choices.items():
        made: list[int] = []
        while len(made) < clocks:
            made += [int(choose())] * rng.randrange(1, 300)
        rows[name] = made[:clocks]
    return rows


def signed(values) -> np.ndarray:
    return (np.asarray(values) + (1 << WIDTH - 1)) % (1 << WIDTH) - (1 << WIDTH - 1)


def load_of(motor, play: int) -> list[int]:
    """Follow a motor with a load that has play, and lies where a movement down leaves it."""
    at, places = 0, []
    for place in motor:
        at = min(max(at, place - play), place)
        places.append(at)
    return places


class TestAxis:
    @pytest.mark.parametrize("play", [0, 1, 5])
    @pytest.mark.parametrize("seed", range(4))
    def test_the_position_is_where_pulses_took_the_load(self, seed, play):
        given = stimulus(seed, 6000, play)
        with AmaranthEngine(component("axis", Axis(module()))) as engine:
            seen = engine.play(given, ["position", "moved", "step_pin", "direction_pin",
                                       "enable_pin"])
        rises = np.diff(seen["step_pin"], prepend=0) == 1
        assert rises.sum() > 100 and seen["enable_pin"][rises].all()
        way = np.where(seen["direction_pin"] == 1, 1, -1)
        motor = np.cumsum(np.where(rises, way, 0))
        assert signed(seen["position"]).tolist() == load_of(motor, play)
        clocks = np.flatnonzero(rises)
        assert np.diff(clocks).min() == SPACING
        # A switch seen in the clock before the edge, or in the three before that, stops it.
        for clock in clocks:
            towards = given["high"] if way[clock] == 1 else given["low"]
            assert not any(towards[max(0, clock - 4) : clock])

    @pytest.mark.parametrize("seed", range(4))
    def test_coils_take_the_load_there_as_well(self, seed):
        given = stimulus(seed, 6000, 3)
        driver = PhaseDriver(sequence=HALF_STEP, period=4)
        with AmaranthEngine(component("axis", Axis(driver))) as engine:
            seen = engine.play(given, ["position", "moved", "coils"])
        # The rotor stays where it is without power, and never has to jump.
        words = [word for word in seen["coils"].tolist() if word]
        turns = [(HALF_STEP.index(b) - HALF_STEP.index(a) + 3) % 8 - 3
                 for a, b in zip([HALF_STEP[0], *words], words, strict=False)]
        assert set(turns) == {-1, 0, 1}
        on = seen["coils"] != 0
        motor = np.cumsum(turns)
        assert signed(seen["position"])[on].tolist() == load_of(motor, 3)
        assert np.diff(np.flatnonzero(seen["moved"])).min() == SPACING

    def test_every_step_of_a_long_way_is_on_time(self):
        """At 19 steps in 240 clocks, none is a clock late, and none is missing."""
        with AmaranthEngine(component("axis", Axis(module()))) as engine:
            engine.set(target=-100 % (1 << WIDTH), run=1, rate=19, enable=1)
            seen = engine.play({"low": [0] * 1400}, ["moved", "position"])
        assert np.flatnonzero(seen["moved"]).tolist() == [
            -(-n * MODULUS // 19) for n in range(1, 101)]
        assert signed(seen["position"])[-1] == -100

    def test_reset_leaves_pulses_and_spacing_as_they_were(self):
        for clock in range(12, 30):
            with AmaranthEngine(component("axis", Axis(module()))) as engine:
                engine.set(target=100, run=1, rate=FASTEST, enable=1)
                rst = [0] * clock + [1] + [0] * 40
                seen = engine.play({"rst": rst}, ["moved", "step_pin", "position"])
            rises = np.flatnonzero(np.diff(seen["step_pin"]) == 1) + 1
            falls = np.flatnonzero(np.diff(seen["step_pin"]) == -1) + 1
            assert (falls - rises[: len(falls)] == 3).all()
            assert np.diff(rises).min() >= SPACING
            assert seen["position"][-1] == (rises > clock + 1).sum()
