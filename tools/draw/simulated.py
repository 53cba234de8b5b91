"""A drawing that was simulated: whether it is what was asked for, in figures and in words."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from fresa.machines.vplotter import VPlotterSettings

from ..console import FIRST_TIME, Progress
from ..cut_picture import duration
from .compare import Comparison, compare, joined
from .curves import Polyline
from .plan import Plan
from .program import strokes
from .simulation import Drawn, WallSender, bounded, build, limit, simulate, string_steps
from .timing import Speeds
from .wall import Part

__all__ = ["Simulated", "compared", "simulated"]


@dataclass(frozen=True)
class Simulated:
    """A drawing that was simulated.

    Attributes
    ----------
    asked : list of list of array of complex
        What each pen was asked to draw, by the times that it touches.
    drawn : Drawn
        What the machine has drawn.
    comparison : Comparison
        How far that is off.
    """

    asked: list[list[Polyline]]
    drawn: Drawn
    comparison: Comparison

    @property
    def right(self) -> bool:
        """Whether the machine has drawn what was asked for."""
        return self.drawn.sound and self.comparison.right

    @property
    def done(self) -> list[list[Polyline]]:
        """What each pen has drawn."""
        lines = iter(self.drawn.lines)
        made = [[*islice(lines, len(part))] for part in self.asked]
        made[-1] += lines
        return made

    @property
    def worst(self) -> tuple[complex, float]:
        """Where it was farthest off, and how far, in mm."""
        return self.comparison.where, self.comparison.worst

    def pictured(self, parts: Sequence[Part]) -> list[Part]:
        """Return what a picture shows as asked for, of the parts of the drawing."""
        return [*parts]

    def facts(self) -> dict[str, Any]:
        """Return the figures, for JSON."""
        drawn, found = self.drawn, self.comparison
        return {
            "right": self.right,
            "seconds": round(drawn.seconds, 3),
            "deviation_mm": round(found.worst, 4),
            "deviation_at_mm": [round(found.where.real, 3), round(found.where.imag, 3)],
            "deviation_line": found.line,
            "deviation_allowed_mm": round(found.limit, 4),
            "lines": found.asked,
            "lines_drawn": found.drawn,
            "steps": dict(zip(("left", "right"), drawn.steps, strict=True)),
            "torn_at_mm": None if drawn.torn is None else [
                round(drawn.torn.real, 3), round(drawn.torn.imag, 3)],
            "words_no_motor_follows": drawn.jumps,
            "pauses": drawn.pauses,
            "clock": drawn.clock,
            "clocks": drawn.clocks,
        }

    def report(self) -> list[str]:
        """Describe it in a few lines."""
        drawn, found = self.drawn, self.comparison
        return [
            *(f"WRONG: {text}" for text in self._wrong()),
            f"simulated: {self._off()}, at {found.where.real:.1f},{found.where.imag:.1f} in "
            f"{self._where()}",
            f"simulated: {duration(drawn.seconds)} on the machine; steps of the strings: left "
            f"{drawn.steps[0]}, right {drawn.steps[1]}",
        ]

    def _where(self) -> str:
        return f"line {self.comparison.line}"

    def _off(self) -> str:
        return f"at most {self.comparison.worst:.3f} mm off the drawing"

    def _wrong(self) -> Iterator[str]:
        drawn, found = self.drawn, self.comparison
        if drawn.torn is not None:
            yield (f"the strings are torn, at {drawn.torn.real:.1f},{drawn.torn.imag:.1f}: "
                   "too short for the way between the pulleys")
        if drawn.jumps:
            yield f"no motor can follow {drawn.jumps} of the coil words"
        if found.asked != found.drawn:
            yield f"{found.drawn} lines were drawn, not {found.asked}"
        if found.beyond > 0:
            yield (f"the pen is {found.beyond:.3f} mm farther off than steps of the strings "
                   "explain")


def simulated(plan: Plan, settings: VPlotterSettings, speeds: Speeds,
              width: float | None = None) -> Simulated:
    """Simulate a drawing, with progress, and compare.

    Parameters
    ----------
    plan : Plan
        What is drawn.
    settings : VPlotterSettings
        The machine.
    speeds : Speeds
        Those of the program.
    width : float, optional
        From pulley to pulley in mm, if it is not that which the machine was built for.

    Raises
    ------
    EngineError, UserError
        As of `build`.
    MachineError, FaultShown
        As of `simulate`.
    """
    with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
        engine = build(settings)
    total = max(1, string_steps(plan, settings))
    with engine, Progress(total, "steps", "drawing") as progress:
        drawn = simulate(plan, WallSender(engine, settings, width), speeds,
                         bounded(progress.advance, total))
    return compared(plan, settings, speeds, drawn)


def compared(plan: Plan, settings: VPlotterSettings, speeds: Speeds, drawn: Drawn) -> Simulated:
    """Compare what was drawn with what was asked for, with progress."""
    groups = [strokes(part, plan.wall, speeds.dwell) for part in plan.parts]
    asked = [[np.concatenate(group) for group in part] for part in groups]
    lines = [line for part in asked for line in part]
    drawn = replace(drawn, lines=joined(drawn.lines, [
        len(group) for part in groups for group in part]))
    with Progress(len(lines), "lines", "comparing") as progress:
        found = compare(lines, drawn.lines, limit(settings), progress.advance)
    return Simulated(asked, drawn, found)
