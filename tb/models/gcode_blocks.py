"""Model from lines of G-code to the blocks of the queue, and to where each of them ends.

Lines are planned by :class:`tb.models.gcode_plan.Planner`. Of an arc the model carries out the
tables of formulas that the gateware has, on the model of arithmetic: so all of its words are those
of the gateware, and what they stand for is compared elsewhere (:mod:`tb.models.arc`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fresa.arithmetic import Line as LineSettings
from fresa.arithmetic.arc import REGISTERS, TABLES

from .formulas import AXES, SIZE, FormulaModel
from .gcode_language import (
    Arc,
    Coolant,
    Interpreter,
    Line,
    Offsets,
    Probe,
    RefusedLine,
    Spindle,
    words,
)
from .gcode_plan import MotionBlock, Planner, PlanSettings
from .profile import Block
from .walk import Walked, segment_steps

__all__ = ["Event", "Motion", "ProgramModel", "corrective"]


@dataclass(frozen=True)
class Motion:
    """A block of motion.

    Attributes
    ----------
    profile : Block
        What the speed profile has of it.
    gain, limit : int
        What the queue has.
    segment : Walked
        What the walk has.
    steps : tuple of int
        By how many steps each axis moves.
    fine, coarse : int
        Steps per metre of the channels u and v.
    """

    profile: Block
    gain: int
    limit: int
    segment: Walked
    steps: tuple[int, ...]
    fine: int = 1
    coarse: int = 1

    def made(self) -> list[int]:
        """Return by how many steps the walk moves each axis, with those that correct an end.

        A line is summed at once, an arc half turn by half turn.
        """
        if self.segment.arc:
            by_channel = [sum(way for _, way in steps)
                          for steps in segment_steps(self.segment, self.fine, self.coarse)]
        else:
            by_channel = [start + increment >> 8 for start, increment in zip(
                self.segment.start, self.segment.increment, strict=True)]
        found = [by_channel[channel] for channel in self.segment.channel]
        return [made + corrective(steps, made)
                for steps, made in zip(self.steps, found, strict=True)]


@dataclass(frozen=True)
class Event:
    """A block that is no motion: spindle, coolant, dwell, pause or end of program."""

    limit: int


def corrective(wanted: Any, made: Any) -> Any:
    """Return the steps that the walk adds at an end: it compares two bits of both counts.

    The numbers may be arrays, of many ends.
    """
    return (wanted - made + 1) % 4 - 1


class ProgramModel:
    """Runs lines of G-code as the machine does, from power-up, as far as its queue of blocks.

    It has neither soft limits, nor system lines, nor overrides.

    Parameters
    ----------
    settings : PlanSettings
        Of the machine.

    Attributes
    ----------
    language : Interpreter
        What lines have set so far.
    """

    def __init__(self, settings: PlanSettings) -> None:
        self.settings = settings
        self.language = Interpreter(steps_per_metre=settings.steps)
        self._planner = Planner(settings)
        self._formulas = FormulaModel(REGISTERS, TABLES, LineSettings(
            clock=settings.clock, speeds=settings.speeds, accelerations=settings.accelerations,
            steps=settings.steps, deviation=settings.deviation))
        self._place = self._planner.places(self.language.position)
        self._outputs_last = False

    def begin(self, position: Sequence[int]) -> None:
        """Let it be at another place at power-up, in nm, that is one of whole steps."""
        for axis, place in enumerate(position):
            self.language.set_position(axis, place)
        self._planner.position = tuple(position)
        self._place = self._planner.places(position)

    def line(self, text: str) -> tuple[str, list[Motion | Event]]:
        """Return the answer to a line, and its blocks.

        Raises
        ------
        ValueError
            If a line probes: where that ends is not known. If an arc by R is within a nm of the
            largest that can be made, so that it is not known whether it can.
        """
        try:
            actions = self.language.line(words(text))
        except RefusedLine as refused:
            return f"error:{refused.args[0]}", []
        blocks: list[Motion | Event] = []
        for action in actions:
            match action:
                case Line():
                    blocks += self._line(action)
                case Arc():
                    blocks += self._arc(action)
                case Offsets():
                    pass
                case Probe():
                    raise ValueError("where a probing ends is not known")
                case Spindle() | Coolant():
                    blocks.append(self._event(stops=self._outputs_last))
                    self._outputs_last = True
                case _:
                    blocks.append(self._event(stops=True))
        return "ok", blocks

    def _event(self, *, stops: bool) -> Event:
        self._outputs_last = False
        if stops:
            self._planner.stop()
        return Event(self._planner.nominal)

    def _line(self, line: Line) -> list[Motion]:
        block = self._planner.line(line.target, line.feed, inverse=line.inverse)
        if block is None:
            return []
        change, start = self._change(block.place)
        return [self._motion(block, change, Walked(
            increment=change, start=start, log2_ticks=block.log2_ticks))]

    def _arc(self, arc: Arc) -> list[Motion]:
        """Plan an arc, and a line to its end if that is not on the circle."""
        formulas, planner = self._formulas, self._planner
        for name, values in (("from", planner.position), ("unit_before", planner.unit),
                             ("place_before", self._place), ("to", arc.target)):
            formulas.set_each(name, values)
        high, low = divmod(planner.nominal, SIZE)
        formulas.set(**{"nominal_before": high, "nominal_before.low": low}, clockwise=arc.clockwise,
                     plane=((0, 1), (2, 0), (1, 2)).index(arc.plane), feed=min(arc.feed, SIZE - 1))
        if arc.radius is None:
            formulas.set(centre_u=arc.centre[0], centre_v=arc.centre[1])
            formulas.run("arc_plane", "arc_check")
        else:
            formulas.set(radius=arc.radius)
            formulas.run("arc_plane", "arc_centre", "arc_check")
        if formulas.get("verdict"):
            raise ValueError(f"the rotator cannot make {arc}")
        formulas.run("arc_path", *["inverse"] * arc.inverse, "arc_plan")

        get = formulas.get
        block = MotionBlock(
            formulas.pair("energy"), formulas.pair("modulus"), get("ticks"), get("hundredth"),
            get("fastest"), formulas.pair("nominal"), formulas.pair("gain"),
            formulas.pair("limit"),
            tuple(get(f"place_{axis}") for axis in AXES))
        change, start = self._change(block.place)
        channels = [get("channels") >> 2 * axis & 3 for axis in range(3)]
        axes = [channels.index(channel) for channel in range(3)]
        planner.position, planner.unit = tuple(formulas.each("to")), tuple(
            formulas.each("unit_end"))
        planner.nominal = block.nominal
        motion = self._motion(block, change, Walked(
            increment=[change[axis] for axis in axes], start=[start[axis] for axis in axes],
            channel=channels, log2_ticks=block.log2_ticks, arc=1, clockwise=get("mirrored"),
            turns=get("turns"), shift=get("shift"), x=formulas.signed("x"),
            y=formulas.signed("y"), residual=get("residual")), axes)
        if not get("apart"):
            return [motion]
        return [motion, *self._line(Line(arc.target, get("feed")))]

    def _change(self, place: Sequence[int]) -> tuple[list[int], list[int]]:
        """Return by how much places change, and where in a step the axes are at the start."""
        return ([(new - old + SIZE // 2) % SIZE - SIZE // 2
                 for new, old in zip(place, self._place, strict=True)],
                [each + 128 & 255 for each in self._place])

    def _motion(self, block: MotionBlock, change: Sequence[int], segment: Walked,
                axes: Sequence[int] = (0, 1, 2)) -> Motion:
        steps = tuple((old + 128 & 255) + by >> 8
                      for old, by in zip(self._place, change, strict=True))
        self._place, self._outputs_last = block.place, False
        return Motion(
            Block(block.energy, block.modulus, block.nominal, block.log2_ticks), block.gain,
            block.limit, segment, steps, *(self.settings.steps[axis] for axis in axes[:2]))
