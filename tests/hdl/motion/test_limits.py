# amaranth: UnusedElaboratable=no

"""Switches at the ends: which count as on, and for how long."""

import pytest

from fresa.motion import Limits
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.motion import LimitsModel
from tb.stimulus import bursts

OUTPUTS = ["at_low", "at_high"]


def limits(axes: int, period: int) -> AmaranthEngine:
    return AmaranthEngine(component("limits", Limits(axes=axes, period=period)))


class TestLimits:
    @pytest.mark.parametrize("axes", [1, 3])
    @pytest.mark.parametrize("period", [1, 2, 5, 16])
    def test_is_its_model_in_every_clock(self, axes, period):
        stimulus = bursts({name: [1] * axes for name in ("low", "high")}
                         | {"rst": [1]}, axes, period, 3000)
        with limits(axes, period) as engine:
            seen = engine.apply(stimulus, OUTPUTS)
        expected = played(LimitsModel(axes=axes, period=period).clock, stimulus)
        assert {name: values.tolist() for name, values in seen.items()} == expected
