# amaranth: UnusedElaboratable=no

"""The rate of steps: exact for ever, whatever it was before."""

import numpy as np
import pytest

from fresa.drive import RateGenerator
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
        times = [-(-n * modulus // rate) for n in range(clocks * rate // modulus + 2)]
        assert due(modulus, [rate] * clocks) == [time for time in times if time < clocks]

    @pytest.mark.parametrize("clock", range(25))
    def test_the_rate_before_a_rest_is_nothing_to_the_times_after_it(self, clock):
        """What is beyond the modulus at rest was once taken for time at the new rate."""
        rates = [48] * (21 + clock) + [1] * 2200
        moved = [0] * (40 + clock) + [1] * 2181
        with generator(1000, 50) as engine:
            seen = engine.apply({"rate": rates, "moved": moved}, ["due"])["due"]
        first = 40 + clock
        assert np.flatnonzero(seen & moved).tolist() == [first, first + 1000, first + 2000]
