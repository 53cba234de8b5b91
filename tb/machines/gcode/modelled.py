"""What the models of `gcode` say of a few programs: blocks, and each edge of STEP in its clock."""

import random
from collections.abc import Iterator

from ...models.gcode_machine import MachineModel
from ...models.gcode_plan import PlanSettings
from . import SHORT

__all__ = ["MODELLED"]

PROGRAMS, LINES = 6, 30


def _program(rng: random.Random) -> Iterator[str]:
    """Yield lines, arcs and helices, long and short, with corners of any angle."""
    yield "G91G21G1F6000"
    for _ in range(LINES):
        size = rng.choice([0.005, 0.05, 0.5])
        x, y, z = (rng.uniform(-size, size) for _ in range(3))
        yield rng.choice([
            f"G0X{x:.4f}Y{y:.4f}Z{z:.4f}", f"G1X{x:.4f}Y{y:.4f}", f"G1X{abs(x):.4f}",
            f"G17G2X0Y0I{size:.4f}J{y:.4f}", f"G18G3X0Z0I{size:.4f}K{z:.4f}Y{y:.4f}",
            f"G19G3Y{size:.4f}Z{size:.4f}J{size:.4f}"])


def _modelled() -> Iterator[str]:
    for number in range(PROGRAMS):
        model = MachineModel(PlanSettings.stored(SHORT.clock, SHORT.store), SHORT.driver)
        model.send("".join(f"{line}\n" for line in _program(random.Random(number))).encode())
        yield repr((model.answers, model.blocks, model.position))
        yield repr(model.steps())


MODELLED = _modelled
