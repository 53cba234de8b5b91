# amaranth: UnusedElaboratable=no

"""Three motors side by side: none knows of the others."""

import random

import pytest

from fresa.drive import AxisDrivers, CoilDriver
from tb.boards import component
from tb.engines import AmaranthEngine


class TestAxisDrivers:
    @pytest.mark.parametrize("period", [1, 4])
    def test_each_is_a_coil_driver(self, period):
        rng = random.Random(period)
        step = [rng.randrange(8) for _ in range(400)]
        direction = [rng.randrange(8) for _ in range(400)]
        with AmaranthEngine(component("axes", AxisDrivers(period=period))) as engine:
            seen = engine.apply(
                {"step": step, "direction": direction},
                ["axis_x", "axis_y", "axis_z", "moved", "refused"],
            )
        for bit, axis in enumerate(["axis_x", "axis_y", "axis_z"]):
            with AmaranthEngine(component("coil", CoilDriver(period=period))) as engine:
                alone = engine.apply(
                    {
                        "step": [s >> bit & 1 for s in step],
                        "direction": [d >> bit & 1 for d in direction],
                    },
                    ["coils", "moved", "refused"],
                )
            assert (seen[axis] == alone["coils"]).all()
            assert (seen["moved"] >> bit & 1 == alone["moved"]).all()
            assert (seen["refused"] >> bit & 1 == alone["refused"]).all()
