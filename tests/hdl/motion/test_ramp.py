# amaranth: UnusedElaboratable=no

"""The ramp: as its model in every clock, and what a motor feels of it, without a model."""

import random
import re
from math import isqrt, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.motion import MAX_ACCELERATION, MAX_LEVELS, Ramp, ramp_rates
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.motion import RampModel

RATES = (10, 24, 31, 37, 40)
RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=15)


class Motor:
    """A component and its model, clock by clock, and a motor that makes steps when it likes."""

    def __init__(self, rates=RATES, *, width: int = 8, seed: int = 0) -> None:
        self.width = width
        self.engine = AmaranthEngine(component("ramp", Ramp(rates=rates, max_rate=63,
                                                            width=width)))
        self.model = RampModel(steps=rates, width=width)
        self.rng = random.Random(seed)
        self.steps: list[int] = []  # the position behind each
        self.clock(0, run=0)  # no step in the first clock

    def __enter__(self) -> "Motor":
        return self

    def __exit__(self, *_) -> None:
        self.engine.close()

    def clock(self, target: int, *, run: int = 1, requested_rate: int = 63, rst: int = 0,
              eager: float = 1) -> None:
        """Make a clock with the same inputs for both."""
        mask = (1 << self.width) - 1
        engine, model = self.engine, self.model
        engine.set(target=target & mask, run=run, requested_rate=requested_rate, rst=rst)
        step, direction = model.request(target=target, run=run)
        moved = int(step and not rst and self.rng.random() < eager)
        engine.set(moved=moved)
        seen = {name: engine.get(name) for name in ("step", "rate", "position", "level")}
        assert seen == {"step": step, "rate": model.rate(requested_rate), "level": model.level,
                        "position": model.place.position & mask}
        assert not step or engine.get("direction") == direction
        engine.run(1)
        model.clock(target=target, run=run, requested_rate=requested_rate, moved=moved, rst=rst)
        if moved:
            self.steps.append(model.place.position)

    def go(self, target: int, *, steps: int = 99, requested_rate: int = 63) -> list[tuple[int,
                                                                                          int]]:
        """Make so many steps, or all; give the position and the level behind each."""
        seen = []
        while len(seen) < steps and self.model.request(target=target, run=1)[0]:
            self.clock(target, requested_rate=requested_rate)
            seen.append((self.model.place.position, self.model.level))
        return seen


class TestRamp:
    @pytest.mark.parametrize("rates", [RATES, (7,), (5, 5, 9, 20), tuple(range(1, 40))])
    def test_is_its_model_in_every_clock(self, rates):
        @RANDOM
        @given(st.lists(st.tuples(st.integers(-99, 99), st.sampled_from([0, 5, 10, 11, 24, 38, 63]),
                                  st.integers(1, 25), st.sampled_from([0.3, 1, 1]),
                                  st.integers(0, 15)), max_size=10), st.integers(0, 99))
        def run(phases, seed) -> None:
            with Motor(rates, seed=seed) as motor:
                for target, requested_rate, clocks, eager, odd in phases:
                    for clock in range(clocks):
                        motor.clock(target, requested_rate=requested_rate,
                                    run=int(odd != 1 or clock > 2),
                                    rst=int(odd == 2 and clock == 1), eager=eager)
                assert all(-99 <= place <= 99 for place in motor.steps)

        run()

    @pytest.mark.parametrize(("target", "levels"), [
        (1, [0]), (2, [1, 0]), (3, [1, 1, 0]), (4, [1, 2, 1, 0]), (5, [1, 2, 2, 1, 0]),
        (-4, [1, 2, 1, 0]), (14, [1, 2, 3, 4, 5, 5, 5, 5, 5, 4, 3, 2, 1, 0]),
    ])
    def test_up_to_the_top_and_down_in_time(self, target, levels):
        with Motor() as motor:
            seen = motor.go(target)
        assert [level for _, level in seen] == levels
        assert seen[-1] == (target, 0)


class TestRates:
    @pytest.mark.parametrize("acceleration", [1, 10, 1000, 33_333, MAX_ACCELERATION])
    def test_are_those_of_a_constant_acceleration(self, acceleration):
        """A step/s is so many parts that what is rounded does not count."""
        rates = ramp_rates(acceleration=acceleration, top=10**6 * isqrt(800 * acceleration),
                           modulus=10**12, clock=10**6)
        times = np.cumsum(1e6 / np.array(rates[:-1], float))
        exact = np.sqrt(2 * np.arange(1, len(rates)) / acceleration)
        assert np.allclose(times, exact, rtol=1e-5)
        assert 390 < len(rates) <= 401

    def test_are_rounded_down_and_end_at_the_top(self):
        rates = ramp_rates(acceleration=1000, top=16_000, modulus=1_000_000_000, clock=50_000_000)
        exact = [20 * sqrt(500) * (sqrt(n) + sqrt(n - 1)) for n in range(1, len(rates) + 1)]
        assert rates[:-1] == tuple(int(rate) for rate in exact[:-1])
        assert rates[-1] == 16_000 <= exact[-1] and len(rates) == 321

    @pytest.mark.parametrize(("changed", "message"), [
        ({"acceleration": 0}, "acceleration must be a whole number from 1 to 1000000, not 0"),
        ({"acceleration": 10**6 + 1}, "acceleration must be a whole number from 1 to 1000000, "
                                      "not 1000001"),
        ({"modulus": 5_000_000, "top": 1}, "acceleration must be a whole number from 200 to "
                                           "1000000, not 100"),
        ({"top": 0}, "top must be a whole number from 1 to 1000000000, not 0"),
        ({"top": 20 * 906}, "at 100 steps/s² it takes more than 4096 steps to the highest rate: "
                            "have more acceleration, or a lower rate"),
    ])
    def test_impossible(self, changed, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            ramp_rates(**{"acceleration": 100, "top": 16_000, "modulus": 10**9,
                          "clock": 50_000_000, **changed})


class TestParameters:
    @pytest.mark.parametrize(("changed", "message"), [
        ({"rates": []}, f"number of rates must be a whole number from 1 to {MAX_LEVELS}, not 0"),
        ({"rates": [0]}, "rate 1 must be a whole number from 1 to 1099511627776, not 0"),
        ({"rates": [3, 2]}, "rate 2 must be a whole number from 3 to 1099511627776, not 2"),
        ({"max_rate": 0}, "max_rate must be a whole number from 1 to 1099511627776, not 0"),
        ({"width": 1}, "width must be a whole number from 2 to 64, not 1"),
    ])
    def test_impossible(self, changed, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Ramp(**{"rates": RATES, "max_rate": 63, **changed})
