# amaranth: UnusedElaboratable=no

"""The rate of steps: exact for ever, whatever it was before."""

import random
import re

import numpy as np
import pytest

from fresa.drive import MAX_MODULUS, RateGenerator
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.drive import RateModel
from tb.stimulus import bursts


def generator(modulus: int, max_rate: int) -> AmaranthEngine:
    dut = RateGenerator(modulus=modulus, max_rate=max_rate)
    return AmaranthEngine(component("rate", dut))


def due(modulus: int, rates: list[int], max_rate: int | None = None) -> list[int]:
    """Clocks of the steps where each is made at once."""
    with generator(modulus, max_rate or max(rates)) as engine:
        seen = engine.apply({"rate": rates, "moved": [1] * len(rates)}, ["due"])["due"]
    return np.flatnonzero(seen).tolist()


class TestRateGenerator:
    @pytest.mark.parametrize(("modulus", "max_rate"), [
        (1, 1), (3, 3), (9, 4), (40, 7), (1000, 10), (50_000_000, 1_000_000), (2**40, 2**40),
    ])
    def test_is_its_model_in_every_clock(self, modulus, max_rate):
        stimulus = bursts({"rate": [max_rate.bit_length()], "moved": [1], "rst": [1]}, modulus, 0,
                         3000)
        with generator(modulus, max_rate) as engine:
            seen = engine.apply(stimulus, ["due"])
        model = RateModel(modulus=modulus, max_rate=max_rate)
        assert seen["due"].tolist() == played(model.clock, stimulus)["due"]
        assert model.made > 10

    @pytest.mark.parametrize(("modulus", "rate"), [
        (1000, 1), (1000, 7), (1000, 333), (1000, 999), (1000, 1000), (62_500_000, 59_999),
        (50_000_000, 1_000_000),
    ])
    def test_every_step_is_less_than_a_clock_late(self, modulus, rate):
        clocks = 5000
        times = [-(-n * modulus // rate) for n in range(1, clocks * rate // modulus + 2)]
        assert due(modulus, [rate] * clocks) == [time for time in times if time < clocks]

    def test_as_many_steps_as_the_rate_in_every_modulus(self):
        """Wherever it begins: 97 in any 1000 clocks in a row."""
        steps = np.bincount(due(1000, [97] * 6000), minlength=6000)
        assert set(np.convolve(steps[1:], np.ones(1000, int), "valid")) == {97}

    def test_a_new_rate_counts_for_the_step_under_way(self):
        assert due(1000, [1] * 500 + [50] * 100) == [510, 530, 550, 570, 590]
        assert due(1000, [50] * 15 + [1] * 400) == [15 + 250]
        assert due(1000, [10] * 90 + [0] * 300 + [10] * 20) == [90 + 300 + 10]

    def test_steps_do_not_hurry_after_a_wait(self):
        """However long one had to wait: the next is due a whole time after it."""
        moved = [0] * 333 + [1] * 200
        with generator(1000, 50) as engine:
            seen = engine.apply({"rate": [50] * len(moved), "moved": moved}, ["due"])["due"]
        assert np.flatnonzero(seen).tolist() == [*range(20, 334), *range(353, 533, 20)]

    @pytest.mark.parametrize("clock", range(25))
    def test_the_rate_before_a_rest_is_nothing_to_the_times_after_it(self, clock):
        """What is beyond the modulus at rest was once taken for time at the new rate."""
        rates = [48] * (21 + clock) + [1] * 2200
        moved = [0] * (40 + clock) + [1] * 2181
        with generator(1000, 50) as engine:
            seen = engine.apply({"rate": rates, "moved": moved}, ["due"])["due"]
        first = 40 + clock
        assert np.flatnonzero(seen & moved).tolist() == [first, first + 1000, first + 2000]

    def test_never_closer_than_the_highest_rate(self):
        rng = random.Random(1)
        rates = [rate for _ in range(300) for rate in [rng.choice([0, 1, 80, 127])]
                 * rng.randrange(1, 40)]
        assert np.diff(due(1000, rates, max_rate=90)).min() >= 1000 // 90

    def test_reset_changes_nothing(self):
        played_ = {"rate": [3] * 90, "moved": [1] * 90}
        with generator(20, 3) as engine, generator(20, 3) as other:
            seen = engine.apply({**played_, "rst": [0, 0, 1] * 30}, ["due"])["due"]
            assert (seen == other.apply(played_, ["due"])["due"]).all()


class TestParameters:
    @pytest.mark.parametrize("modulus", [0, -1, MAX_MODULUS + 1, 5e7])
    def test_impossible_modulus(self, modulus):
        message = f"modulus must be a whole number from 1 to 1099511627776, not {modulus!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            RateGenerator(modulus=modulus, max_rate=1)

    @pytest.mark.parametrize("rate", [0, -1, 51, 1.5])
    def test_impossible_rate(self, rate):
        message = f"max_rate must be a whole number from 1 to 50, not {rate!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            RateGenerator(modulus=50, max_rate=rate)
