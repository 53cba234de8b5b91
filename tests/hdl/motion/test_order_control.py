# amaranth: UnusedElaboratable=no

"""One simple movement: as many steps as ordered, a period apart, and then rest."""

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
        requested = [clock for clock, row in enumerate(rows) if row["step"]]
        assert rows[0]["taken"] and rows[0]["clear"]
        assert requested == [period * (n + 1) for n in range(steps)]
        assert {rows[clock]["step"] for clock in requested} == {0b011}
        assert {row["direction"] for row in rows[1:]} == {0b001}
        # At rest after the clock that sees the end and the one that clears.
        ready = [clock for clock, row in enumerate(rows) if row["moves_ready"]]
        assert ready[:2] == [0, requested[-1] + 3]
