# amaranth: UnusedElaboratable=no

"""Points: a dictionary in gateware."""

import random

import pytest

from fresa.motion import PointStore
from tb.boards import component
from tb.engines import AmaranthEngine


@pytest.mark.parametrize(("points", "axes", "width"),
                         [(7, 3, 32), (5, 2, 4), (1, 1, 2), (8, 8, 64)])
def test_is_a_dictionary_in_every_clock(points, axes, width):
    rng = random.Random(points)
    kept: dict[int, list[int]] = {}
    before = None
    store = PointStore(points=points, axes=axes, width=width)
    top = (1 << points.bit_length()) - 1
    places, found = ([f"{name}_{axis}" for axis in range(axes)] for name in ("place", "found"))
    seen = 0
    with AmaranthEngine(component("points", store)) as engine:
        for _ in range(600):
            number, given = rng.randint(0, top), [rng.getrandbits(width) for _ in range(axes)]
            store_now, rst = rng.random() < 0.4, rng.random() < 0.01
            engine.set(number=number, store=store_now, rst=rst,
                       **dict(zip(places, given, strict=True)))
            assert engine.get("stored") == (number in kept)
            if before is not None:
                assert [engine.get(name) for name in found] == before
                seen += 1
            engine.run(1)
            before = kept.get(number)
            if store_now and 1 <= number <= points:
                kept[number] = given
            if rst:
                kept.clear()
    assert seen > 50
