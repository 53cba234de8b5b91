"""A drawing by the commands of the first firmware, on gateware whose lines are bowed.

The machine homes, as it draws by commands only where it knows its place; then each straight piece
of a line is `:I` and `:F`. What the pen does is compared with the straight lines that the commands
ask for, and with the ideal bow, of which each string changes its length at a constant speed.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fresa.machines.vplotter import VPlotterSettings
from fresa_host.vplotter import VPlotterSession
from tb.engines import Engine

from ..console import FIRST_TIME, Progress
from .compare import Comparison, compare
from .curves import Polyline
from .plan import Plan
from .program import point_command, segments
from .simulated import Simulated
from .simulation import Drawn, WallSender, bounded, build, limit, string_steps
from .wall import Part

__all__ = ["ALLOWED_STEPS", "BowedSender", "Bows", "bow_steps", "compared", "simulated"]

ALLOWED_STEPS = 1.75
"""Half steps from the ideal bow, at most: half of one as an end is rounded, half of one until a
step is due, half of one as that waits for a step of the other motor, and a quarter by ticks: half
of one, an eighth of a step, in each coordinate of an end, and up to one in the wall's width."""


class BowedSender(WallSender):
    """The machine with bowed lines, its strings and end switches, and a session with it.

    Attributes
    ----------
    session : VPlotterSession
        The sender.
    """

    session: VPlotterSession

    def __init__(self, engine: Engine, settings: VPlotterSettings) -> None:
        super().__init__(engine, settings)
        self.session = VPlotterSession(name="the simulation", baud=settings.line_baud)


@dataclass(frozen=True)
class Bows(Simulated):
    """A drawing that was simulated with bowed lines.

    Attributes
    ----------
    steps : float
        Half steps that a string was off the ideal bow, at most.
    """

    steps: float

    @property
    def right(self) -> bool:
        """Whether each line was drawn, as the bow that it should be."""
        return (self.drawn.sound and self.comparison.asked == self.comparison.drawn
                and self.steps <= ALLOWED_STEPS)

    def pictured(self, parts: Sequence[Part]) -> list[Part]:
        """Return the parts with the straight lines of the commands."""
        return [part._replace(lines=lines)
                for part, lines in zip(parts, self.asked, strict=True)]

    def facts(self) -> dict[str, Any]:
        """Return the figures, for JSON."""
        return {**super().facts(), "bowed": True, "deviation_allowed_mm": None,
                "bow_steps": round(self.steps, 3), "bow_steps_allowed": ALLOWED_STEPS}

    def report(self) -> list[str]:
        """Describe it in a few lines."""
        return [*super().report(),
                f"simulated: at most {self.steps:.2f} half steps of a string off the bows that "
                "strings at constant speed draw"]

    def _where(self) -> str:
        return f"piece {self.comparison.line} of {self.comparison.asked}"

    def _off(self) -> str:
        return f"bowed by at most {self.comparison.worst:.3f} mm"

    def _wrong(self) -> Iterator[str]:
        yield from super()._wrong()
        if self.steps > ALLOWED_STEPS:
            yield (f"a string is {self.steps:.2f} half steps off the bow; {ALLOWED_STEPS:g} are "
                   "what rounding explains")


def simulated(plan: Plan, settings: VPlotterSettings) -> Bows:
    """Simulate a drawing with bowed lines, with progress, and compare.

    Parameters
    ----------
    plan : Plan
        What is drawn.
    settings : VPlotterSettings
        The machine, with bowed lines.

    Raises
    ------
    EngineError, UserError
        As of `build`.
    MachineError, FaultShown
        If a command is refused, an alarm is raised, or the machine shows a fault.
    """
    with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
        engine = build(settings)
    left, right = (abs(complex(across, settings.rest[1])) * settings.steps_of_string
                   for across in (settings.rest[0], settings.wall_width - settings.rest[0]))
    homing = round(5 * left + 3 * right)  # one is paid out where the other one is wound
    total = homing + string_steps(plan, settings)
    with engine, Progress(total, "steps", "homing and drawing") as progress:
        drawn, rows = _simulate(plan, BowedSender(engine, settings),
                                bounded(progress.advance, total))
    return compared(plan, settings, drawn, rows)


def _simulate(plan: Plan, sender: BowedSender, progress: Callable[[int], None]
              ) -> tuple[Drawn, list[NDArray[np.int64]]]:
    session = sender.session
    sender.do(session.open())
    sender.do(session.order(":P1", "Motors powered."))
    sender.do(session.order(":H", "Homed."), progress)
    begin, before = sender.seconds, sender.steps
    for part in plan.parts:
        for start, end in segments(part):
            sender.do(session.order(point_command("I", start), "At the start point."), progress)
            sender.do(session.order(point_command("F", end), "Line drawn."), progress)
        sender.do(session.order(point_command("I", plan.wall.resting), "At the start point."),
                  progress)
    drawn = sender.drawn(sender.finish(progress) - begin)
    left, right = (each - own for each, own in zip(drawn.steps, before, strict=True))
    return replace(drawn, steps=(left, right)), sender.touching()


def compared(plan: Plan, settings: VPlotterSettings, drawn: Drawn,
             rows: Sequence[NDArray[np.int64]]) -> Bows:
    """Compare what was drawn with what was asked for, with progress.

    Parameters
    ----------
    plan, settings
        As of `simulated`.
    drawn : Drawn
        What the machine has drawn.
    rows : sequence of array
        Of each line a column for each change: its clock, and the lengths of both strings in half
        steps; the last is that with which the line ends.
    """
    asked = [[np.array(each) for each in segments(part)] for part in plan.parts]
    lines = [line for part in asked for line in part]
    with Progress(len(lines), "lines", "comparing") as progress:
        found: Comparison = compare(lines, drawn.lines, limit(settings), progress.advance)
    off = max((bow_steps(line, own, settings) for line, own in zip(lines, rows, strict=False)),
              default=0.0)
    # A bow is farther off than steps explain: what is right is said by the ideal one.
    return Bows(asked, drawn, replace(found, beyond=min(found.beyond, 0.0)), off)


def bow_steps(line: Polyline, rows: NDArray[np.int64], settings: VPlotterSettings) -> float:
    """Return how far strings were off the ideal bow at most, in half steps.

    Both go from the length at the begin of the line to that at its end in the time that the motor
    with more steps takes, half a pace before its first and behind its last step among that.

    Parameters
    ----------
    line : array of complex
        Begin and end of the line, in mm on the wall.
    rows : array
        As of `compared`.
    settings : VPlotterSettings
        The machine.
    """
    clocks, lengths = rows[0], rows[1:].astype(float)
    firsts, lasts = (np.array([abs(place), abs(settings.wall_width - place)])
                     * settings.steps_of_string for place in (line[0], line[-1]))
    steps = np.abs(np.diff(lengths, axis=1)).sum(axis=1).max()
    moved = np.flatnonzero((np.diff(lengths, axis=1) != 0).any(axis=0))
    begin = clocks[moved[0] + 1] if len(moved) else clocks[0]

    def off(at: NDArray[np.int64], seen: NDArray[np.float64]) -> float:
        part = np.clip((at - begin) / settings.pace + 0.5, 0, steps) / max(steps, 1)
        ideal = firsts[:, None] + part * (lasts - firsts)[:, None]
        return float(np.abs(seen - ideal).max(initial=0))

    # Of each length when it is made, and just before the next one is.
    return max(off(clocks[:-1], lengths[:, :-1]), off(clocks[1:], lengths[:, :-1]))
