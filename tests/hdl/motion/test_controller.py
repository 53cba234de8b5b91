# amaranth: UnusedElaboratable=no

"""Both modes before one set of motors. Their pins at every clock are tested with the machine."""

import random
import re

import pytest

from fresa.motion import NumericalController
from tb.boards import component
from tb.engines import AmaranthEngine

COILS = ["axis_x", "axis_y", "axis_z"]


def controller(**parameters) -> AmaranthEngine:
    parameters = {"period": 2, "z_travel": 3, **parameters}
    return AmaranthEngine(component("controller", NumericalController(**parameters)))


class TestModes:
    def test_only_the_mode_that_is_on_drives(self):
        """Jog switches are dead in automatic mode, orders in manual mode, at every clock."""
        rng = random.Random(3)
        with controller() as engine:
            before = engine.get(*COILS)
            for _ in range(300):
                engine.set(mode=1, jog=rng.randrange(64))
                engine.run(1)
                assert engine.get(*COILS, "jogging") == (*before, 0)
            for _ in range(300):
                engine.set(mode=0, jog=0, start=rng.randrange(2), order=rng.getrandbits(34))
                engine.run(1)
                assert engine.get(*COILS, "ready", "count") == (*before, 0, 0)

    def test_where_manual_mode_leaves_the_tool_is_the_origin(self):
        with controller() as engine:
            engine.set(mode=1, order=9 | 4 << 16, start=1, select=1)
            engine.run(60)
            assert engine.get("count", "ready") == (9, 1)
            before = engine.get(*COILS)
            engine.set(mode=0, start=0)
            engine.run(3)
            engine.set(mode=1)
            engine.run(1)
            assert engine.get("count") == 0
            assert engine.get(*COILS) == before

    def test_what_moves_by_hand(self):
        with controller() as engine:
            engine.run(2)
            for jog, axes in [(0b000001, 1), (0b001000, 2), (0b110000, 4), (0b100101, 7), (0, 0)]:
                engine.set(jog=jog)
                engine.run(1)
                assert engine.get("jogging") == axes
            engine.set(jog=0b111111, stop=1)
            engine.run(1)
            assert engine.get("jogging") == 0


class TestParameters:
    @pytest.mark.parametrize(
        ("name", "value", "message"),
        [
            ("period", 0, "period must be a whole number from 1 to 67108864, not 0"),
            ("jog_period", 0, "jog_period must be a whole number from 1 to 67108864, not 0"),
            ("z_travel", 0, "z_travel must be a whole number from 1 to 32768, not 0"),
        ],
    )
    def test_impossible_values(self, name, value, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            NumericalController(**{"period": 2, "z_travel": 3, name: value})
