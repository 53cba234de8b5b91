# amaranth: UnusedElaboratable=no

"""The counts: of steps that are made, by whatever axis, and of no others."""

import random

import pytest

from fresa.motion import AutomaticControl
from tb.boards import component
from tb.engines import AmaranthEngine


@pytest.mark.parametrize("period", [1, 3])
def test_counts_are_of_steps_made(period):
    rng = random.Random(period)
    at, main = [0, 0, 0], 0
    with AmaranthEngine(component("automatic", AutomaticControl(period=period))) as engine:
        for _ in range(1500):
            axes = rng.choice([1, 2, 3, 4, 3])
            engine.set(
                moves_valid=rng.random() < 0.5,
                select=rng.randrange(4),
                moves_payload=axes | rng.randrange(8) << 3 | rng.randrange(9) << 6,
            )
            step, direction = engine.get("step", "direction")
            moved = step & rng.randrange(8) if rng.random() < 0.3 else step
            engine.set(moved=moved)
            begins = engine.get("moves_ready")
            before = engine.get("at_x", "at_y", "at_z")
            assert before == tuple(n % 65536 for n in at)
            engine.run(1)
            for axis in range(3):
                if moved >> axis & 1:
                    at[axis] += 1 if direction >> axis & 1 else -1
            main += bool(moved)
            if begins and not engine.get("moves_ready"):
                main = 0
            shown = []
            for select in range(4):
                engine.set(select=select)
                shown.append(engine.get("shown"))
            assert shown == [main, *(n % 65536 for n in at)]
    assert min(at) < 0 < max(at) or any(at)
