# amaranth: UnusedElaboratable=no

"""The backlash of gears, against a motor and the load that it pushes."""

import random

import pytest

from fresa.motion import Backlash
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.motion import BacklashModel
from tb.stimulus import bursts


def counted(max_backlash: int, **rows) -> list[int]:
    with AmaranthEngine(component("backlash", Backlash(max_backlash=max_backlash))) as engine:
        return engine.apply(rows, ["counted"])["counted"].tolist()


class TestBacklash:
    @pytest.mark.parametrize("max_backlash", [1, 2, 5, 12, 1000])
    @pytest.mark.parametrize("seed", range(3))
    def test_is_its_model_in_every_clock(self, max_backlash, seed):
        """Also where the backlash changes while it is taken up."""
        stimulus = bursts({"backlash": [max_backlash.bit_length()], "moved": [1], "direction": [1],
                          "rst": [1]}, seed, max_backlash, 3000)
        assert counted(max_backlash, **stimulus) == played(BacklashModel().clock,
                                                           stimulus)["counted"]

    @pytest.mark.parametrize("backlash", range(6))
    def test_a_load_follows_its_motor(self, backlash):
        """By a mechanism of two bodies: a pin of the motor in a slot of the load."""
        rng = random.Random(backlash)
        ways = [way for _ in range(150) for way in [rng.randrange(2)] * rng.randrange(1, 9)]
        seen = counted(5, backlash=[backlash] * len(ways), moved=[1] * len(ways), direction=ways)
        # the slot is from `slot` to `slot + backlash`; it rests where down leaves it
        pin = slot = 0
        for way, counts in zip(ways, seen, strict=True):
            pin += 1 if way else -1
            pushed = max(slot, pin - backlash) if way else min(slot, pin)
            assert counts == (pushed != slot)
            slot = pushed
