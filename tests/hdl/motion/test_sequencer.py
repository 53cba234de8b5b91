# amaranth: UnusedElaboratable=no

"""Complex movements into simple ones, for a taker that is in no hurry."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.motion import MotionSequencer
from tb.boards import component
from tb.engines import AmaranthEngine

TRAVEL = 5
RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=60)


class Taker:
    """Takes movements after a while, makes them after another, and is ready again then."""

    def __init__(self, engine, rng: random.Random) -> None:
        self.engine, self.rng = engine, rng
        self.at = [0, 0, 0]
        self.moves: list[tuple[int, ...]] = []
        self.left = 0
        self.offered = None
        self.reluctant = 0.0
        self.show()

    def show(self) -> None:
        self.engine.set(**{f"at_{n}": at % 65536 for n, at in zip("xyz", self.at, strict=True)})

    def clock(self) -> None:
        ready = not self.left and self.rng.random() >= self.reluctant
        self.engine.set(moves_ready=ready)
        valid, payload = self.engine.get("moves_valid", "moves_payload")
        if self.offered is not None:
            assert (valid, payload) == (1, self.offered), "an offer was withdrawn"
        self.offered = payload if valid and not ready else None
        self.engine.run(1)
        if self.left:
            self.left -= 1
        elif valid and ready:
            axes, direction, steps = payload & 7, payload >> 3 & 7, payload >> 6
            self.moves.append(
                tuple((1 if direction >> n & 1 else -1) * steps * (axes >> n & 1) for n in range(3))
            )
            for n, move in enumerate(self.moves[-1]):
                self.at[n] += move
            # It is where it ends only in the end; until then its place says nothing.
            self.left = self.rng.choice([1, 2, 3, 9])
        self.show()

    def order(self, x=0, y=0, up=0, down=0) -> list[tuple[int, ...]]:
        """Give an order, wait for its end, and return the movements that it was split into."""
        self.moves = []
        self.engine.set(order=x | y << 16 | up << 32 | down << 33, start=1)
        assert self.engine.get("ready") == 1
        self.clock()
        self.engine.set(start=0)
        if self.rng.random() < 0.5:  # it was looked at in the clock in which it was taken
            self.engine.set(order=self.rng.getrandbits(32))
        assert self.engine.get("ready") == 0
        for _ in range(500):
            self.clock()
            if self.engine.get("ready"):
                return self.moves
        raise AssertionError("never ready again")


def split(at, x, y):
    """A diagonal as long as the shorter way and a straight rest."""
    ways = (x - at[0], y - at[1])
    both = min(map(abs, ways))
    sign = [(way > 0) - (way < 0) for way in ways]
    diagonal = (sign[0] * both, sign[1] * both, 0)
    rest = (ways[0] - diagonal[0], ways[1] - diagonal[1], 0)
    return [move for move in (diagonal, rest) if any(move)]


@pytest.fixture(scope="module")
def engine():
    with AmaranthEngine(component("sequencer", MotionSequencer(z_travel=TRAVEL))) as engine:
        yield engine


@pytest.fixture
def taker(engine):
    return fresh(engine, 1)


def fresh(engine, seed: int) -> Taker:
    engine.set(rst=1, start=0, hold=0)
    engine.run(1)
    engine.set(rst=0)
    return Taker(engine, random.Random(seed))


place = st.one_of(st.integers(0, 5), st.integers(0, 65535), st.sampled_from([0, 65535, 32768]))


class TestPositioning:
    @RANDOM
    @given(
        places=st.lists(st.tuples(place, place), min_size=1, max_size=6),
        seed=st.integers(0, 99),
        reluctant=st.sampled_from([0, 0.5, 0.9]),
    )
    def test_a_diagonal_and_a_straight_rest(self, engine, places, seed, reluctant):
        taker = fresh(engine, seed)
        taker.reluctant = reluctant
        for x, y in places:
            expected = split(taker.at, x, y)
            assert [move for move in taker.order(x, y) if any(move)] == expected
            assert taker.at == [x, y, 0]
            assert not engine.get("error")


class TestMilling:
    @pytest.mark.parametrize(
        ("x", "y"), [(x, y) for x in (-7, -1, 0, 1, 7) for y in (-7, -1, 0, 1, 7)]
    )
    def test_only_along_8_directions(self, engine, taker, x, y):
        taker.order(10, 10)
        assert taker.order(down=1) == [(0, 0, -TRAVEL)]
        moves = taker.order(10 + x, 10 + y)
        straight = x == 0 or y == 0 or abs(x) == abs(y)
        assert moves == ([(x, y, 0)] if straight and (x or y) else [])
        assert engine.get("error") == (not straight)
        assert engine.get("ready") == 1


class TestTool:
    def test_longest_travel(self):
        with AmaranthEngine(component("sequencer", MotionSequencer(z_travel=2**15))) as engine:
            taker = Taker(engine, random.Random(0))
            assert taker.order(down=1) == [(0, 0, -(2**15))]
            assert taker.order(down=1) == []
            assert taker.order(up=1) == [(0, 0, 2**15)]
