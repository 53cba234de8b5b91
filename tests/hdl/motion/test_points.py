# amaranth: UnusedElaboratable=no

"""Points: a dictionary in gateware."""

import random
import re

import pytest

from fresa.motion import PointStore
from fresa.motion.points import MAX_POINTS
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


@pytest.mark.parametrize(("name", "value", "limits"), [
    ("points", 0, f"points must be a whole number from 1 to {MAX_POINTS}, not 0"),
    ("points", MAX_POINTS + 1, "points must be a whole number from 1 to 1023, not 1024"),
    ("axes", 9, "axes must be a whole number from 1 to 8, not 9"),
    ("width", 1, "width must be a whole number from 2 to 64, not 1"),
])
def test_impossible(name, value, limits):
    with pytest.raises(ValueError, match=f"^{re.escape(limits)}$"):
        PointStore(**{name: value})
