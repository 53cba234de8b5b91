# amaranth: UnusedElaboratable=no

"""Jog switches."""

from fresa.motion import ManualControl
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ["step", "direction", "active"]


def wanted(jog: int) -> tuple[int, int]:
    """Axes that move, and those of them that go up: both on means up."""
    axes = [(jog >> 2 * n & 1, jog >> 2 * n + 1 & 1) for n in range(3)]
    return (
        sum(bool(up or down) << n for n, (up, down) in enumerate(axes)),
        sum(up << n for n, (up, _) in enumerate(axes)),
    )


class TestManualControl:
    def test_every_combination(self):
        jog = [0, *range(64)]
        with AmaranthEngine(component("manual", ManualControl(period=1))) as engine:
            seen = engine.apply({"enable": [1] * 65, "jog": jog}, OUTPUTS)
        for clock in range(1, 65):
            active, up = wanted(jog[clock])
            assert (seen["active"][clock], seen["step"][clock]) == (active, active)
            assert seen["direction"][clock] & active == up
