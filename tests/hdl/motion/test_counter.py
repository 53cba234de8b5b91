# amaranth: UnusedElaboratable=no

"""The counter, against whole numbers."""

import random

from fresa.motion import StepCounter
from tb.boards import component
from tb.engines import AmaranthEngine


def run(**played):
    with AmaranthEngine(component("counter", StepCounter())) as engine:
        return engine.apply(played, ["count"])["count"].tolist()


class TestStepCounter:
    def test_counts(self):
        rng = random.Random(1)
        played = {
            name: [int(rng.random() < share) for _ in range(1000)]
            for name, share in [("step", 0.7), ("direction", 0.5), ("clear", 0.02), ("rst", 0.01)]
        }
        count, expected = 0, []
        for step, direction, clear, rst in zip(*played.values(), strict=True):
            expected.append(count % 65536)
            count = 0 if clear or rst else count + (step and (1 if direction else -1))
        assert run(**played) == expected
