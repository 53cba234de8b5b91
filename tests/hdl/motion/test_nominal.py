"""The speed that a block may have: against a product, and how soon it obeys an override."""

import random

import pytest

from fresa.motion import NominalSpeed, OverrideKind
from tb.boards import component
from tb.engines import AmaranthEngine, Engine

SPEED_BITS = 9


def square(hundredth: int, fastest: int, percent: int) -> int:
    """Return the squared speed of a block."""
    return min(hundredth * percent >> 8, fastest)**2


def load(engine: Engine, hundredth: int, fastest: int, kind: OverrideKind) -> None:
    """Load the next block, and wait until its speed is known."""
    for which, word in (1, fastest), (2, hundredth):
        engine.set(load=which, word=word, override=kind.value)
        engine.run(1)
    engine.set(load=0)
    engine.run(SPEED_BITS + 15, until={"ready": 1})
    assert engine.get("ready")


def take(engine: Engine) -> None:
    """Let the next block run."""
    engine.set(take=1)
    engine.run(1)
    engine.set(take=0)


@pytest.fixture
def engine():
    with AmaranthEngine(component("nominal", NominalSpeed(speed_bits=SPEED_BITS, word_bits=12))
                        ) as engine:
        engine.set(rst=0, feed=100, rapid=100)
        yield engine


def test_is_the_square_of_the_smaller_of_two(engine):
    rng = random.Random(1)
    shown = 0
    for _ in range(150):
        feed, rapid = rng.randint(10, 200), rng.choice([25, 50, 100])
        hundredth, kind = rng.randrange(1 << rng.randint(1, 12)), rng.choice(list(OverrideKind))
        fastest = rng.randrange(1 << rng.randint(1, SPEED_BITS))
        engine.set(feed=feed, rapid=rapid)
        load(engine, hundredth, fastest, kind)
        take(engine)
        shown = square(hundredth, fastest, {OverrideKind.FEED: feed, OverrideKind.RAPID: rapid,
                                            OverrideKind.NONE: 100}[kind])
        assert engine.get("nominal") == shown
        engine.run(rng.randrange(100))
        assert engine.get("nominal") == shown


def test_both_blocks_obey_in_any_clock(engine):
    most, percent = 3 * (SPEED_BITS + 14), 100
    load(engine, 400, 500, OverrideKind.FEED)
    take(engine)
    load(engine, 300, 500, OverrideKind.FEED)
    for phase in range(2 * (SPEED_BITS + 14) + 1):
        percent = (20, 200)[phase % 2]
        engine.run(most + phase)
        engine.set(feed=percent)
        engine.run(most, until={"nominal": square(400, 500, percent)})
        assert engine.get("nominal") == square(400, 500, percent)
    engine.run(most)
    take(engine)
    assert engine.get("nominal") == square(300, 500, percent)
