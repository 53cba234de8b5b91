"""Model of the G-code machine: from lines of a program to each edge of STEP, in its clock.

It goes from event to event, not from clock to clock: lines to blocks, the plan of the queue,
granules of the speed profile, the ticks of each, the steps that these make, and the pulses that the
drivers make of them.

What it promises: if all blocks are in the queue before the first of them begins, as behind a hold,
and there is nothing but motion, then every rising edge of STEP of each axis comes in its clock, all
counted from one instant: that in which the first block begins. A program that is longer than the
queue, or is sent while it moves, ends in the same place by the same steps, but the clocks depend on
when each line comes, as the speed at an end does on the lines that are known by then.
"""

from collections.abc import Sequence

from .gcode_blocks import Event, Motion, ProgramModel, corrective
from .gcode_plan import PlanSettings
from .plan import plan
from .profile import ProfileModel
from .walk import PathWalkModel, segment_steps, turn_ticks

__all__ = ["MachineModel", "pulses", "requested_steps"]

DELAY = PathWalkModel.DELAY
Steps = list[tuple[int, int]]
"""Clocks of steps, and 1 for those forward, -1 for those back."""

PENDING = 2
"""Clocks from a step of the walk to that in which its driver sees it."""


def _ticks(blocks: Sequence[Motion]) -> list[list[int]]:
    """Return the clocks of the ticks of each block, in a queue that has them all."""
    entries = [*plan([(block.limit, block.gain) for block in blocks]), 0]
    profile = ProfileModel([(block.profile, 0) for block in blocks],
                           lambda number, _: entries[number + 1])
    clocks: list[list[int]] = [[] for _ in blocks]
    for granule in profile.granules():
        clocks[granule.block] += granule.clocks(profile.backlog)
    return clocks


def _half_turns(block: Motion, ticks: Sequence[int], loaded: int) -> dict[int, int]:
    """Return when the half turns of an arc are made, by their tick: each takes two clocks.

    It is two clocks after the tick, but not before the rotator is loaded.
    """
    made, free = {}, loaded
    for tick in turn_ticks(block.segment.turns, block.segment.log2_ticks):
        made[tick] = now = max(ticks[tick - 1] + 2, free)
        free = now + 2
    return made


def requested_steps(blocks: Sequence[Motion]) -> list[Steps]:
    """Return the steps that the walk requests of each axis."""
    steps: list[dict[int, int]] = [{}, {}, {}]
    ends: list[tuple[int, int, int]] = []  # clock, axis, and corrective step
    before = -10**6  # the last tick of the block before
    for block, ticks in zip(blocks, _ticks(blocks), strict=True):
        channels: list[Steps] = [
            [(ticks[tick - 1] + DELAY + 1, way) for tick, way in made]
            for made in segment_steps(block.segment, block.fine, block.coarse)]
        if block.segment.arc:
            turns = _half_turns(block, ticks, before + DELAY + 1)
            for channel, delay in (0, 1), (1, 3):
                channels[channel] = [
                    (turns[tick] + delay, way) for tick, way in segment_steps(
                        block.segment, block.fine, block.coarse)[channel]]
        before = ticks[-1]
        for axis, channel in enumerate(block.segment.channel):
            steps[axis] |= dict(channels[channel])
            step = corrective(block.steps[axis], sum(way for _, way in channels[channel]))
            if step:
                ends.append((before + DELAY + 3, axis, step))
    for clock, axis, step in ends:
        while clock in steps[axis]:
            clock += 1
        steps[axis][clock] = step
    return [sorted(each.items()) for each in steps]


def pulses(requests: Steps, *, width: int, low: int, setup: int, hold: int) -> Steps:
    """Return the rising edges of STEP of a driver, of requests to it.

    Requests wait while its times last, and one back cancels one forward that waits.

    Parameters
    ----------
    requests : list of tuple
        Ascending clocks in which the driver first sees a step, and its direction.
    width, low, setup, hold : int
        Times of the driver, in clocks: see :class:`fresa.drive.StepDirDriver`.
    """
    edges: Steps = []
    pending = place = clock = free = 0
    forward = False  # the level of DIR
    while pending or place < len(requests):
        if place < len(requests) and (not pending or requests[place][0] <= max(clock, free)):
            seen, way = requests[place]
            clock, pending, place = max(clock, seen), pending + way, place + 1
            continue
        clock = max(clock, free)
        if forward != (pending > 0):
            forward, free = pending > 0, clock + setup
        else:
            way = 1 if forward else -1
            edges.append((clock + 1, way))
            pending, free = pending - way, clock + width + max(low, hold)
            clock += 1
    return edges


class MachineModel:
    """The machine from power-up, with a program that is in its queue before it begins.

    Parameters
    ----------
    settings : PlanSettings
        Of the machine.
    driver : mapping of str to int
        Times of its drivers in clocks, as of :func:`pulses`.

    Attributes
    ----------
    program : ProgramModel
        What lines have set so far.
    blocks : list
        Blocks of all lines.
    answers : list of str
        Answers to all lines, in order.
    """

    def __init__(self, settings: PlanSettings, driver: dict[str, int]) -> None:
        self.program = ProgramModel(settings)
        self.driver = driver
        self.blocks: list[Motion | Event] = []
        self.answers: list[str] = []

    def send(self, program: bytes) -> None:
        """Take lines, each ended by a line feed."""
        for line in program.decode("ascii").splitlines():
            answer, blocks = self.program.line(line)
            self.answers.append(answer)
            self.blocks += blocks

    @property
    def position(self) -> list[int]:
        """Where the axes are at the end, in steps."""
        ends = [block.made() for block in self.blocks if isinstance(block, Motion)]
        return [sum(axis) for axis in zip(*ends, strict=True)] if ends else [0, 0, 0]

    def steps(self) -> list[Steps]:
        """Return the rising edges of STEP of each axis, and 1 for a step forward, -1 for one back.

        Raises
        ------
        ValueError
            If there is a block that is no motion, or more than 63.
        """
        motions = [block for block in self.blocks if isinstance(block, Motion)]
        if len(motions) < len(self.blocks):
            raise ValueError("clocks are those of motions alone")
        if len(motions) > 63:
            raise ValueError(f"{len(motions)} blocks are more than the queue takes")
        return [pulses([(clock + PENDING, way) for clock, way in steps], **self.driver)
                for steps in requested_steps(motions)]
