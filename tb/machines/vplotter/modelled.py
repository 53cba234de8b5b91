"""What the models of `vplotter` say of a few programs: each half step, in its clock."""

import random
from collections.abc import Iterator
from math import hypot

from ...models.gcode_blocks import Motion
from ...models.gcode_machine import MachineModel, requested_steps
from ...models.gcode_plan import PlanSettings
from ...models.strings import PlotterModel, Steps
from . import SHORT

__all__ = ["MODELLED", "modelled_steps", "program"]

PROGRAMS, LINES = 4, 30


def program(rng: random.Random, count: int) -> list[str]:
    """Return lines and arcs that stay on the wall, by distances from the place of rest."""
    found, at = ["G91G1F60000"], [0.0, 0.0]
    while len(found) < count:
        size = rng.choice([0.03, 0.3, 2, 5])
        to = [max(-4, min(4, at[axis] + rng.uniform(-size, size))) for axis in range(2)]
        x, y = (round(to[axis] - at[axis], 3) for axis in range(2))
        at = [at[0] + x, at[1] + y]
        found.append(rng.choice([
            f"G1X{x:.3f}Y{y:.3f}", f"G0X{x:.3f}Y{y:.3f}", f"G1X{x:.3f}Y{y:.3f}F30000",
            f"G3X{x:.3f}Y{y:.3f}R{hypot(x, y) + 0.01:.3f}F60000"]))
    return found


def modelled_steps(lines: list[str]) -> list[Steps]:
    """Return the steps of both motors, of lines that are in the queue before the first begins."""
    tick = 10**6 // int(SHORT.steps_per_mm[0])
    place = SHORT.ticks(SHORT.rest[0]), SHORT.ticks(SHORT.rest[1])
    model = MachineModel(PlanSettings.stored(SHORT.clock, SHORT.store), SHORT.driver)
    model.program.begin((place[0] * tick - SHORT.wall_width * 10**6,
                         SHORT.least_y * 10**6 - place[1] * tick, 0))
    model.send("".join(f"{line}\n" for line in lines).encode())
    right, up, _ = requested_steps([each for each in model.blocks if isinstance(each, Motion)])
    return PlotterModel(width=SHORT.ticks(SHORT.wall_width), place=place,
                        period=SHORT.period).steps(right, up)


def _modelled() -> Iterator[str]:
    for number in range(PROGRAMS):
        yield repr(modelled_steps(program(random.Random(number), LINES)))


MODELLED = _modelled
