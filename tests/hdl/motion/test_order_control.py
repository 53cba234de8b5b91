# amaranth: UnusedElaboratable=no

"""One simple movement: as many steps as ordered, a period apart, and then rest."""

import random
from itertools import pairwise

import pytest

from fresa.motion import OrderControl
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ["moves_ready", "clear", "step", "direction", "fault"]


def run(period: int, moves, clocks: int, *, refuse=lambda: False):
    """Offer moves (axes, direction, steps) one after the other; count the steps that are made."""
    rows = []
    waiting = list(moves)
    count = 0
    with AmaranthEngine(component("orders", OrderControl(period=period))) as engine:
        for _ in range(clocks):
            axes, direction, steps = waiting[0] if waiting else (0, 0, 0)
            engine.set(
                moves_valid=bool(waiting),
                count=count,
                moves_payload=axes | direction << 3 | steps << 6,
            )
            row = dict(zip(OUTPUTS, engine.get(*OUTPUTS), strict=True))
            taken = bool(waiting and row["moves_ready"])
            made = bool(row["step"]) and not refuse()
            rows.append({**row, "taken": taken, "made": made, "count": count})
            if taken:
                waiting.pop(0)
            count = 0 if row["clear"] else count + made
            engine.run(1)
    return rows


class TestOrderControl:
    @pytest.mark.parametrize("period", [1, 2, 5])
    @pytest.mark.parametrize("steps", [1, 2, 7])
    def test_steps(self, period, steps):
        rows = run(period, [(0b011, 0b001, steps)], 4 + period * (steps + 2))
        asked = [clock for clock, row in enumerate(rows) if row["step"]]
        assert rows[0]["taken"] and rows[0]["clear"]
        assert asked == [period * (n + 1) for n in range(steps)]
        assert {rows[clock]["step"] for clock in asked} == {0b011}
        assert {row["direction"] for row in rows[1:]} == {0b001}
        # At rest after the clock that sees the end and the one that clears.
        ready = [clock for clock, row in enumerate(rows) if row["moves_ready"]]
        assert ready[:2] == [0, asked[-1] + 3]

    @pytest.mark.parametrize("period", [1, 3])
    @pytest.mark.parametrize("move", [(0b011, 0, 0), (0b000, 0b111, 5)])
    def test_nothing_to_do(self, period, move):
        rows = run(period, [move, (0b100, 0b100, 1)], 12)
        assert [row["step"] for row in rows if row["step"]] == [0b100]

    def test_one_after_the_other(self):
        moves = [(0b001, 0b001, 3), (0b010, 0b000, 2), (0b100, 0b100, 4), (0b011, 0b010, 1)]
        rows = run(2, moves, 60)
        asked = [(row["step"], row["direction"]) for row in rows if row["step"]]
        assert asked == [
            (axes, direction) for axes, direction, steps in moves for _ in range(steps)
        ]
        times = [clock for clock, row in enumerate(rows) if row["step"]]
        assert min(b - a for a, b in pairwise(times)) == 2

    @pytest.mark.parametrize("period", [1, 3])
    def test_a_refused_step_is_asked_for_again(self, period):
        rng = random.Random(period)
        rows = run(period, [(0b001, 0, 9)], 200, refuse=lambda: rng.random() < 0.5)
        assert sum(row["made"] for row in rows) == 9
        assert sum(bool(row["step"]) for row in rows) > 9
        assert rows[-1]["moves_ready"]

    def test_longest_movement_ends(self):
        with AmaranthEngine(component("orders", OrderControl(period=1))) as engine:
            engine.set(moves_valid=1, moves_payload=1 | 65535 << 6)
            engine.run(1)
            engine.set(moves_valid=0, count=65534)
            engine.run(3)
            assert engine.get("step") == 1
            engine.set(count=65535)
            assert engine.get("step") == 0
            engine.run(2)
            assert engine.get("moves_ready") == 1

    def test_impossible_period(self):
        with pytest.raises(ValueError, match=r"^period must be .*, not 0$"):
            OrderControl(period=0)
