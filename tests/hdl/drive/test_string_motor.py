# amaranth: UnusedElaboratable=no

"""The motor of a string: it counts what it makes, and makes what is wanted, whatever changes."""

import random
import re

import pytest

from fresa.drive import HALF_STEP, StringMotor
from tb.boards import component
from tb.engines import AmaranthEngine


class Motor:
    """A model: coils, a length, and how long the coils rested."""

    def __init__(self, period: int, first: int, bits: int) -> None:
        self.period, self.first, self.size = period, first, 1 << bits
        self.made, self.row, self.rested, self.coils = first, 0, -1, 0

    def clock(self, *, length, follow, step, longer, zero, place, enable, inverted, rst) -> bool:
        """Do a clock; return whether a step is made."""
        wanted = self.made != length if follow else step
        out = self.made < length if follow else longer
        moved = bool(enable and not rst and wanted and not (zero or place)
                     and self.rested >= self.period - 1 and self.coils)
        self.rested = -1 if not enable else 0 if moved else self.rested + 1
        if moved:
            self.row = (self.row + (1 if bool(out) != bool(inverted) else -1)) % 8
        self.coils = HALF_STEP[self.row] if enable else 0
        if rst:
            self.made = self.first
        elif zero or place:
            self.made = 0 if zero else length
        elif moved:
            self.made = (self.made + (1 if out else -1)) % self.size
        return moved


@pytest.mark.parametrize(("period", "first"), [(1, 0), (2, 9), (5, 31)])
def test_is_its_model_in_every_clock(period, first):
    rng, model = random.Random(period), Motor(period, first, 6)
    length, steps, changes = first, 0, 0
    enable = follow = inverted = 0
    with AmaranthEngine(component("string_motor", StringMotor(
            bits=6, period=period, first=first))) as engine:
        for clock in range(1500):
            if rng.random() < 0.03:
                length = rng.randrange(64)
            elif rng.random() < 0.3:
                length = max(0, min(63, length + rng.choice([-1, 1])))
            if rng.random() < 0.02:
                enable, follow, inverted = rng.random() < 0.8, rng.random() < 0.7, rng.random() < .5
            pins = {"length": length, "follow": int(follow), "step": int(rng.random() < 0.5),
                    "longer": int(rng.random() < 0.5), "zero": int(rng.random() < 0.005),
                    "place": int(rng.random() < 0.005), "enable": int(enable),
                    "inverted": int(inverted), "rst": int(rng.random() < 0.005)}
            engine.set(**pins)
            seen = dict(zip(("made", "coils", "behind"), engine.get("made", "coils", "behind"),
                            strict=True))
            assert seen == {"made": model.made, "coils": model.coils,
                            "behind": int(model.made != length)}, clock
            moved = engine.get("moved")
            assert moved == model.clock(**pins), clock
            steps += moved
            changes += moved and follow
            engine.run(1)
    assert steps > 60 and 20 < changes < steps


def test_it_ends_where_it_shall_whatever_it_was_kept_from():
    rng = random.Random(4)
    with AmaranthEngine(component("string_motor", StringMotor(
            bits=8, period=3, first=100))) as engine:
        engine.set(follow=1, enable=1)
        length = 100
        for _ in range(300):
            length = max(0, min(255, length + rng.randint(-3, 3)))
            engine.set(length=length, enable=int(rng.random() < 0.9))
            engine.run(rng.randint(1, 4))
        engine.set(enable=1)
        engine.run(4 * 256)
        assert engine.get("made", "behind") == (length, 0)
        assert engine.get("coils") == HALF_STEP[(length - 100) % 8]


@pytest.mark.parametrize(("parameters", "message"), [
    ({"bits": 3}, "bits of a length must be a whole number from 4 to 24, not 3"),
    ({"bits": 5, "first": 32}, "first length must be a whole number from 0 to 31, not 32"),
])
def test_impossible(parameters, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        StringMotor(**{"period": 2, **parameters})
