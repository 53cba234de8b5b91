# amaranth: UnusedElaboratable=no

"""The walk round a square."""

import random

import pytest

from fresa.motion import SquareGenerator
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ["orders_valid", "orders_payload", "busy", "fault"]


def corners(side: int) -> list[int]:
    return [side, side | side << 16, side << 16, 0]


class TestSquareGenerator:
    @pytest.mark.parametrize("side", [1, 10, 65_535])
    @pytest.mark.parametrize("share", [0.1, 0.5, 1])
    def test_walks_when_started(self, side, share):
        """Each order holds until it is taken, however long that is; a start while busy is lost."""
        rng = random.Random(side)
        walks, taken, offered = 0, [], None
        with AmaranthEngine(component("square", SquareGenerator(side=side))) as engine:
            for _ in range(400):
                start, ready = int(rng.random() < 0.3), int(rng.random() < share)
                engine.set(start=start, orders_ready=ready)
                valid, payload, busy, fault = engine.get(*OUTPUTS)
                assert not fault and valid == busy
                if offered is not None:
                    assert (valid, payload) == (1, offered)
                offered = payload if valid and not ready else None
                if valid and ready:
                    taken.append(payload)
                walks += start and not busy
                engine.run(1)
        assert walks > 2
        assert len(taken) >= 4 * (walks - 1)
        assert taken == (corners(side) * walks)[: len(taken)]
