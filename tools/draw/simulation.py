"""A drawing on the gateware of `vplotter`, and what the pen does on the wall.

Coil words of the motors become steps, these lengths of strings, and these places of the pen, by
whole arrays. End switches are as the lengths say; homing is not needed, since the strings begin
where the place of rest is, as `$X` takes for granted.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor

import numpy as np
from numpy.typing import NDArray

from fresa.machines.vplotter import VPlotterSettings
from fresa_host.gcode_lines import program
from tb.engines import Engine, choose
from tb.machines.vplotter import MACHINE
from tb.wall_plant import hanging

from ..console import UserError
from ..gcode.sender import Sender
from .curves import Polyline
from .picture import travels
from .plan import Plan
from .program import gcode
from .strings import MotorString, step_mm
from .timing import Speeds
from .wall import Wall

__all__ = ["Drawn", "WallSender", "bounded", "build", "limit", "settings_of", "simulate",
           "string_steps"]

CLOCKS = (2_500_000, 5_000_000, 10_000_000, 20_000_000)
"""In Hz. The first is used at which the machine can be built."""

BIT = 16
"""Clocks per bit, the fewest that a receiver can work with: the line is not what takes time."""

OUTPUTS = ("tx", "left", "right", "pen", "moving", "fault")

ROUNDING_MM = 0.01
"""Of the coordinates in the program, and of the place in ticks."""


@dataclass(frozen=True)
class Drawn:
    """What the machine has drawn.

    Attributes
    ----------
    lines : list of array of complex
        Where the pen was while it touched, in mm on the wall, at each step of a string; a line for
        each time that it did.
    seconds : float
        Of the machine, from the first line of the program to the end of the last movement.
    steps : tuple of int
        Of the left and of the right string, in both directions.
    torn : complex or None
        Where the strings first were too short for the way between the pulleys, if they were.
    jumps : int
        Coil words that no motor can follow.
    pauses : int
        For other pens; they were ended at once.
    clock : int
        Of the simulation, in Hz.
    clocks : int
        Since power-up.
    """

    lines: list[Polyline]
    seconds: float
    steps: tuple[int, int]
    torn: complex | None
    jumps: int
    pauses: int
    clock: int
    clocks: int

    @property
    def sound(self) -> bool:
        """Whether the strings and their motors were right."""
        return self.torn is None and not self.jumps


class WallSender(Sender):
    """The machine, its strings, and a session with it.

    Parameters
    ----------
    engine : Engine
        The machine, at power-up.
    settings : VPlotterSettings
        What it was built with. The strings are as long as at its place of rest.
    width : float, optional
        From pulley to pulley, in mm, if it is not that of the settings.
    """

    def __init__(self, engine: Engine, settings: VPlotterSettings, width: float | None = None
                 ) -> None:
        self._per_mm = settings.steps_of_string
        self._width = settings.wall_width if width is None else width
        x, y = settings.rest
        self._strings = [MotorString(round(abs(complex(across, y)) * self._per_mm))
                         for across in (x, settings.wall_width - x)]
        self._rows: list[NDArray[np.int32]] = []
        self._clocks: list[NDArray[np.int64]] = []
        self._limits = 0
        super().__init__(engine, settings, OUTPUTS, limits=0)

    def _follow(self, clocks: NDArray[np.int64], rows: dict[str, NDArray]) -> None:
        left, right = (string.feel(rows[name]) for string, name in zip(
            self._strings, ("left", "right"), strict=True))
        self.steps_made = sum(string.steps for string in self._strings)
        found = np.stack([left, right, rows["pen"]]).astype(np.int32)
        changed = np.ones(found.shape[1], bool)
        changed[1:] = (found[:, 1:] != found[:, :-1]).any(axis=0)
        if self._rows and (found[:, 0] == self._rows[-1][:, -1]).all():
            changed[0] = False
        if changed.any():
            self._rows.append(found[:, changed])
            self._clocks.append(clocks[changed])
        limits = sum((string.length < 0) << side for side, string in enumerate(self._strings))
        if limits != self._limits:
            self._limits = limits
            self.engine.set(limits=limits)

    @property
    def steps(self) -> tuple[int, int]:
        """Steps of the left and of the right string so far."""
        left, right = self._strings
        return left.steps, right.steps

    def drawn(self, seconds: float) -> Drawn:
        """Return what was drawn so far, given what it has taken."""
        rows = np.concatenate(self._rows, axis=1)
        left_mm, right_mm = rows[0] / self._per_mm, rows[1] / self._per_mm
        places = hanging(left_mm, right_mm, self._width)
        torn = np.flatnonzero(left_mm + right_mm < self._width)
        left, right = self._strings
        return Drawn(
            [places[a:b] for a, b in self._touches(rows[2])], seconds, self.steps,
            complex(places[torn[0]]) if len(torn) else None, left.jumps + right.jumps, self.pauses,
            self._settings.clock, self.engine.clock)

    def touching(self) -> list[NDArray[np.int64]]:
        """Return the clocks of what was drawn, and the lengths of the strings in half steps.

        Of each time that the pen has touched a column for each change, and one for its end.
        """
        rows = np.concatenate(self._rows, axis=1).astype(np.int64)
        clocks = np.append(np.concatenate(self._clocks), self.engine.clock)
        lengths = np.concatenate([rows[:2], rows[:2, -1:]], axis=1)
        return [np.concatenate([clocks[None, a:b + 1], lengths[:, a:b + 1]])
                for a, b in self._touches(rows[2])]

    @staticmethod
    def _touches(pen: NDArray) -> list[tuple[int, int]]:
        """Return in which rows the pen touches, and from which on it does not."""
        turns = np.diff(pen, prepend=0, append=0)
        begins, ends = (np.flatnonzero(turns == turn).tolist() for turn in (1, -1))
        return list(zip(begins, ends, strict=True))


def settings_of(wall: Wall, speeds: Speeds, bowed: int = 0) -> VPlotterSettings:
    """Return the machine for a wall, at the lowest clock at which it can be built.

    Parameters
    ----------
    wall : Wall
        The wall.
    speeds : Speeds
        Its speeds.
    bowed : int
        Half steps a second of bowed lines and of homing; 0 for a machine whose lines are straight.

    Raises
    ------
    UserError
        If it cannot be.
    """
    width, height, top, x, y = (_whole(name, value) for name, value in (
        ("--wall", wall.width), ("--wall", wall.height), ("--top", wall.top),
        ("--rest", wall.resting.real), ("--rest", wall.resting.imag)))
    rate, change = (Fraction(str(each)) for each in (speeds.rapid, speeds.acceleration))
    z = VPlotterSettings()
    errors = []
    for clock in CLOCKS:
        try:
            made = VPlotterSettings(
                clock=clock, baud=clock // BIT, wall_width=width, wall_height=height, least_y=top,
                rest=(x, y), max_rate=(rate, rate, z.max_rate[2]),
                acceleration=(change, change, z.acceleration[2]),
                string_rate=bowed or max(1, min(z.string_rate, floor(rate / 60 * z.string_steps))),
                bowed=bowed > 0)
            _ = made.bit  # raises it too
        except ValueError as error:
            errors.append(error)
        else:
            return made
    raise _not_built(errors[0])


def _not_built(error: ValueError) -> UserError:
    return UserError(f"a plotter with these options cannot be built: {error}")


def _whole(option: str, value: float) -> int:
    if value != round(value):
        raise UserError(f"--simulate takes whole mm, as the machine is built with them: {option} "
                        f"is {value:g}")
    return round(value)


def build(settings: VPlotterSettings) -> Engine:
    """Build the machine on the compiled engine.

    Raises
    ------
    EngineError
        If there is no C++ compiler.
    UserError
        If the machine cannot be built so.
    """
    engine = choose("cxxrtl")
    try:
        return engine(MACHINE.design(settings=settings), stretches=True)
    except ValueError as error:
        raise _not_built(error) from error


def simulate(plan: Plan, sender: WallSender, speeds: Speeds,
             progress: Callable[[int], None] = lambda made: None) -> Drawn:
    """Draw; pauses for other pens are ended at once.

    Parameters
    ----------
    plan : Plan
        What is drawn.
    sender : WallSender
        The machine.
    speeds : Speeds
        Those of the program.
    progress : callable
        Called with the steps made since the last call.

    Raises
    ------
    MachineError
        If a line is refused, or an alarm is raised.
    FaultShown
        If the machine shows a fault.
    """
    lines = gcode(plan.parts, plan.wall, speeds.feed, speeds.dwell).splitlines()
    sender.do(sender.session.open())
    sender.do(sender.session.ask("$X"))
    begin = sender.seconds
    sender.do(sender.session.stream(program(lines)), progress)
    return sender.drawn(sender.finish(progress) - begin)


def bounded(advance: Callable[[int], None], most: int) -> Callable[[int], None]:
    """Return what advances a bar by steps, no farther than to an estimate of all of them."""
    left = most

    def limited(made: int) -> None:
        nonlocal left
        made = min(made, left)
        left -= made
        advance(made)

    return limited


def string_steps(plan: Plan, settings: VPlotterSettings) -> int:
    """Return about how many steps both strings take."""
    per_mm = settings.steps_of_string
    ways: Sequence[Polyline] = [*plan.lines, *(
        np.array(way) for way in travels(plan.parts, plan.wall.resting))]
    total = 0.0
    for way in ways:
        along = np.concatenate([[0], np.abs(np.diff(way)).cumsum()])
        places = np.interp(np.linspace(0, along[-1], int(along[-1]) + 2), along, way)
        total += sum(float(np.abs(np.diff(np.abs(places - pulley))).sum())
                     for pulley in (0, plan.wall.width))
    return round(total * per_mm)


def limit(settings: VPlotterSettings) -> Callable[[Polyline], NDArray[np.float64]]:
    """Return what gives how far the pen may be off its line at places: a step of each string."""
    step = 1 / settings.steps_of_string
    return lambda places: ROUNDING_MM + step_mm(places, settings.wall_width, step)
