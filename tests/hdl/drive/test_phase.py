# amaranth: UnusedElaboratable=no

"""One motor by any table, against a model that counts places and clocks."""

import pytest

from fresa.drive import (
    FULL_STEP,
    HALF_STEP,
    ONE_PHASE,
    CoilDriver,
    PhaseDriver,
    swap_inner,
)
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.drive import PhaseModel
from tb.stimulus import bursts

INPUTS = {"step": [1], "direction": [1], "enable": [1], "rst": [1]}
OUTPUTS = ["ready", "moved", "coils"]


def driver(**parameters) -> AmaranthEngine:
    return AmaranthEngine(component("phase", PhaseDriver(**parameters)))


class TestPhaseDriver:
    @pytest.mark.parametrize("sequence", [FULL_STEP, HALF_STEP, ONE_PHASE, swap_inner(HALF_STEP)])
    @pytest.mark.parametrize("period", [1, 2, 5])
    def test_is_its_model_in_every_clock(self, sequence, period):
        stimulus = bursts(INPUTS, period, len(sequence), 3000)
        with driver(sequence=sequence, period=period) as engine:
            seen = engine.apply(stimulus, OUTPUTS)
        expected = played(PhaseModel(sequence=sequence, period=period).clock, stimulus)
        assert {name: values.tolist() for name, values in seen.items()} == expected
        assert set(seen["coils"]) == {0, *sequence}

    def test_moves_as_the_driver_of_the_mill(self):
        """With power all the time, and a table that both know."""
        stimulus = bursts({"step": [1], "direction": [1], "rst": [1]}, 5, 0, 3000)
        with AmaranthEngine(component("coil", CoilDriver(period=3))) as mill, \
                driver(sequence=FULL_STEP, period=3) as engine:
            engine.set(enable=1)
            engine.run(4)
            expected = mill.apply(stimulus, ["coils", "moved"])
            seen = engine.apply(stimulus, ["coils", "moved"])
        assert (seen["coils"] == expected["coils"]).all() and expected["moved"].any()
        assert (seen["moved"] == expected["moved"]).all()

    def test_impossible_sequence(self):
        with pytest.raises(ValueError, match="^sequence must be 4 or 8 .*, not \\(1, 2\\)$"):
            PhaseDriver(sequence=(1, 2), period=1)
