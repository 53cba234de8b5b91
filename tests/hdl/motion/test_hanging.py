# amaranth: UnusedElaboratable=no

"""A point on two strings: it is where it shall be, and strings are as long as its ways."""

import random
import re
from math import isqrt

import pytest

from fresa.motion import TICKS_LOG2, Hanging
from tb.boards import component
from tb.engines import AmaranthEngine

TICKS = 1 << TICKS_LOG2


def nearest(across: int, below: int) -> int:
    """Length in whole steps; of two that are as near, the shorter."""
    squares = across**2 + below**2
    return (isqrt(4 * squares - 1) + TICKS) // (2 * TICKS) if squares else 0


class Wall:
    """A walk on a wall, whose ticks come at any time."""

    def __init__(self, engine, width: int, first: tuple[int, int], most: int, seed: int) -> None:
        self.engine, self.width, self.first, self.most = engine, width, first, most
        self.rng = random.Random(seed)
        self.place = list(first)

    def tick(self, ways: list[int]) -> None:
        """Give a tick: to the right, and down."""
        for way, end in enumerate((self.width, self.most)):
            if not 0 <= self.place[way] + ways[way] <= end:
                ways[way] = 0
            self.place[way] += ways[way]
        right, down = ways
        self.engine.set(step=(right != 0) | (down != 0) << 1,
                        direction=(right > 0) | (down < 0) << 1)
        self.engine.run(1)
        self.engine.set(step=0)

    def rest(self) -> None:
        """Wait until it is at rest, and check it."""
        for _ in range(60):
            if not self.engine.get("busy"):
                break
            self.engine.run(1)
        across, below = self.place
        assert self.engine.get("busy", "fault", "across", "below") == (0, 0, across, below)
        assert self.engine.get("lengths_0", "lengths_1") == (
            nearest(across, below), nearest(self.width - across, below))


@pytest.mark.parametrize(("seed", "width", "first"), [
    (1, 700, (350, 400)), (2, 901, (0, 0)), (3, 640, (640, 3))])
def test_strings_have_the_nearest_length_wherever_it_goes(seed, width, first):
    with AmaranthEngine(component("hanging", Hanging(
            width=width, first_across=first[0], first_below=first[1], bits=10))) as engine:
        wall = Wall(engine, width, first, 1023, seed)
        wall.rest()
        for _ in range(20):
            ways = [wall.rng.randint(-1, 1), wall.rng.randint(-1, 1)]
            for _ in range(wall.rng.randint(1, 30)):
                wall.tick(list(ways))
                if wall.rng.random() < 0.3:  # back and forth, in adjacent clocks
                    for _ in range(wall.rng.randint(1, 3)):
                        wall.tick([-way for way in ways])
                        wall.tick(list(ways))
                engine.run(8)  # a tick is worked on in less
            wall.rest()


def test_what_waits_is_dropped():
    with AmaranthEngine(component("hanging", Hanging(
            width=500, first_across=250, first_below=250, bits=10))) as engine:
        wall = Wall(engine, 500, (250, 250), 1023, 5)
        for _ in range(7):
            wall.tick([1, 1])
        engine.set(drop=1)
        engine.run(1)
        engine.set(drop=0)
        engine.run(20)
        wall.place = list(engine.get("across", "below"))
        assert 250 < wall.place[0] < 257 and wall.place[0] == wall.place[1]
        wall.rest()


def test_ticks_without_room_are_a_fault_until_it_begins_anew():
    with AmaranthEngine(component("hanging", Hanging(
            width=500, first_across=250, first_below=250, bits=10))) as engine:
        wall = Wall(engine, 500, (250, 250), 1023, 5)
        for _ in range(20):
            wall.tick([-1, 0])
        assert engine.get("fault") == 1
        engine.set(begin=1)
        engine.run(1)
        engine.set(begin=0)
        wall.place = [250, 250]
        wall.rest()


@pytest.mark.parametrize(("parameters", "message"), [
    ({"width": 1024}, "width in ticks must be a whole number from 1 to 1023, not 1024"),
    ({"first_across": 11}, "first_across must be a whole number from 0 to 10, not 11"),
    ({"first_below": 1024}, "first_below must be a whole number from 0 to 1023, not 1024")])
def test_impossible(parameters, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Hanging(**{"width": 10, "first_across": 5, "first_below": 5, "bits": 10, **parameters})
