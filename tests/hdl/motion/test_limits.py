# amaranth: UnusedElaboratable=no

"""Switches at the ends: what they block, and for how long."""

import re

import pytest

from fresa.drive import MAX_PERIOD
from fresa.motion import Limits
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.motion import LimitsModel
from tb.stimulus import bursts

OUTPUTS = ["allowed", "at_low", "at_high"]


def limits(axes: int, period: int) -> AmaranthEngine:
    return AmaranthEngine(component("limits", Limits(axes=axes, period=period)))


class TestLimits:
    @pytest.mark.parametrize("axes", [1, 3])
    @pytest.mark.parametrize("period", [1, 2, 5, 16])
    def test_is_its_model_in_every_clock(self, axes, period):
        stimulus = bursts({name: [1] * axes for name in ("step", "direction", "low", "high")}
                         | {"rst": [1]}, axes, period, 3000)
        with limits(axes, period) as engine:
            seen = engine.apply(stimulus, OUTPUTS)
        expected = played(LimitsModel(axes=axes, period=period).clock, stimulus)
        assert {name: values.tolist() for name, values in seen.items()} == expected


class TestParameters:
    @pytest.mark.parametrize("axes", [0, 65, 1.0])
    def test_impossible_axes(self, axes):
        message = f"axes must be a whole number from 1 to 64, not {axes!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Limits(axes=axes, period=1)

    @pytest.mark.parametrize("period", [0, MAX_PERIOD + 1])
    def test_impossible_periods(self, period):
        message = f"limits period must be a whole number from 1 to {MAX_PERIOD}, not {period!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Limits(axes=1, period=period)
