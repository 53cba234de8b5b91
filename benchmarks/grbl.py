"""A model of how GRBL 1.1h moves, for figures beside those of the gateware.

There is no AVR here. This is written from the algorithm in the source of GRBL (gnea/grbl, commit
bfb67f0), whose file is named at each number: ends of lines are rounded to steps, the planner looks
ahead over its blocks, segments of 10 ms have one speed each, and Bresenham's algorithm makes steps
in ticks of a timer. It is kinder than the original: numbers are not of single precision, lines are
there as soon as there is room for them, and no calculation takes time.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import atan2, ceil, cos, floor, hypot, inf, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

__all__ = ["BAUD", "HOLD_S", "PLANNED", "STEPS_PER_S", "Block", "Machine", "chords", "duration",
           "blocks", "walked", "step_instants"]

CPU = 16_000_000
"""Clocks a second of the AVR (Makefile)."""
BAUD = 115_200
"""config.h: BAUD_RATE."""
STEPS_PER_S = 30_000
"""README.md, and the comment at the interrupt in stepper.c."""
PLANNED = 15
"""planner.h: of BLOCK_BUFFER_SIZE, 16, one is always free."""
SEGMENT_S = 1 / 100
"""config.h: ACCELERATION_TICKS_PER_SECOND."""
SEGMENTS = 5
"""stepper.h: of SEGMENT_BUFFER_SIZE, 6, one is always free."""
HOLD_S = SEGMENTS * SEGMENT_S
"""Segments that are made as they are when a hold comes: stepper.c says 40 to 50 ms."""
CUTOFFS = (8000, 4000, 2000)
"""stepper.c: steps a second below which a step has 2, 4 and 8 ticks (AMASS)."""
STRAIGHT = 0.999999
"""planner.c: cosine beyond which two lines are taken for one, or for there and back."""


@dataclass(frozen=True)
class Machine:
    """Settings: steps/mm, mm/s and mm/s² of all axes, junction deviation and arc tolerance, mm."""

    steps: float
    speed: float
    acceleration: float
    deviation: float = 0.010
    tolerance: float = 0.002


@dataclass(frozen=True)
class Block:
    """A line in the planner.

    Attributes
    ----------
    steps : tuple of int
        Of each axis.
    length, nominal, acceleration : float
        Along it, in mm, mm/s and mm/s².
    junction : float
        Square of the highest speed at which it may begin, by its corner alone.
    """

    steps: tuple[int, ...]
    length: float
    nominal: float
    acceleration: float
    junction: float


def chords(begin: Sequence[float], end: Sequence[float], centre: Sequence[float],
           clockwise: bool, tolerance: float) -> Iterator[tuple[float, float]]:
    """Yield the ends of the lines of an arc (motion_control.c: mc_arc)."""
    first = atan2(begin[1] - centre[1], begin[0] - centre[0])
    travel = atan2(end[1] - centre[1], end[0] - centre[0]) - first
    if clockwise:
        travel -= 2 * pi * ceil((travel + 5e-7) / (2 * pi))
    else:
        travel -= 2 * pi * floor((travel - 5e-7) / (2 * pi))
    radius = hypot(begin[0] - centre[0], begin[1] - centre[1])
    count = floor(abs(travel * radius) / 2 / sqrt(tolerance * (2 * radius - tolerance)))
    for number in range(1, count):
        angle = first + travel * number / count
        yield centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)
    yield end[0], end[1]


def _limit(most: float, way: NDArray[np.float64]) -> float:
    """Return what no axis takes beyond its limit, along a direction (nuts_bolts.c)."""
    return most / float(np.abs(way).max())


def blocks(machine: Machine, path: Sequence[tuple[Sequence[float], float]]) -> list[Block]:
    """Return the blocks of lines from 0 to points in mm, each with a feed in mm/s.

    planner.c: plan_buffer_line. An infinite feed is that of G0.
    """
    made: list[Block] = []
    at, before = np.zeros(len(path[0][0]), np.int64), None
    for point, feed in path:
        target = np.floor(np.array(point) * machine.steps + 0.5).astype(np.int64)
        by = target - at
        if not by.any():
            continue
        length = float(np.linalg.norm(by / machine.steps))
        way = by / machine.steps / length
        made.append(Block(tuple(map(int, by)), length, min(feed, _limit(machine.speed, way)),
                          _limit(machine.acceleration, way),
                          0 if before is None else junction(machine, before, way)))
        at, before = target, way
    return made


def junction(machine: Machine, before: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """Return the square of the highest speed at a corner, of the directions at both sides."""
    cosine = -float(before @ way)
    if cosine > STRAIGHT:
        return 0.0
    if cosine < -STRAIGHT:
        return inf
    change = way - before
    half = sqrt((1 - cosine) / 2)
    return (_limit(machine.acceleration, change / np.linalg.norm(change)) * machine.deviation
            * half / (1 - half))


def duration(made: Sequence[Block], planned: int = PLANNED) -> float:
    """Return how long blocks take, in seconds, from rest to rest.

    When one begins, it and those after it are planned, so many of them; the last of these ends at
    rest, so that the machine could always stop.
    """
    most = [min(block.junction, block.nominal**2, before.nominal**2)
            for before, block in zip([made[0], *made], made, strict=False)]
    speed2 = seconds = 0.0
    for number, block in enumerate(made):
        end2 = 0.0
        for ahead in range(min(number + planned, len(made)) - 1, number, -1):
            end2 = min(most[ahead], end2 + 2 * made[ahead].acceleration * made[ahead].length)
        gain = 2 * block.acceleration * block.length
        end2 = min(end2, speed2 + gain)
        top2 = min(block.nominal**2, (speed2 + end2 + gain) / 2)
        begin, top, end = (sqrt(max(0.0, each)) for each in (speed2, top2, end2))
        ramps = (2 * top2 - speed2 - end2) / 2 / block.acceleration
        seconds += ((2 * top - begin - end) / block.acceleration
                    + max(0.0, block.length - ramps) / top)
        speed2 = end2
    return seconds


def walked(made: Sequence[Block]) -> NDArray[np.int64]:
    """Return the places of the motors after each tick without smoothing: one step or more each."""
    places = []
    at = np.zeros(len(made[0].steps), np.int64)
    for block in made:
        steps = np.abs(block.steps)
        events = int(steps.max())
        # The counter of an axis begins at half, and a step is made where it passes the events.
        count = (2 * np.arange(1, events + 1)[:, None] * steps + events - 1) // (2 * events)
        places.append(at + np.sign(block.steps) * count)
        at = at + np.array(block.steps)
    return np.concatenate(places)


def step_instants(block: Block) -> list[NDArray[np.float64]]:
    """Return when each axis steps in a line from rest to rest, in seconds (stepper.c).

    A segment lasts 10 ms, with the time of a part of a step that is left over from the one before,
    and all of its steps are as far apart.
    """
    events = max(map(abs, block.steps))
    per_mm = events / block.length
    ticks, increments = [], []
    now = made = left = 0.0
    total = 2 * _ramp(block) + max(0.0, block.length - block.nominal**2 / block.acceleration
                                   ) / block.nominal
    at = 0.0
    while made < events:
        at = min(at + SEGMENT_S, total)
        place = block.length if at >= total else _place(block, at, total)
        whole = events if at >= total else floor(place * per_mm + 1e-9)
        if whole == made:
            left += SEGMENT_S
            continue
        length = SEGMENT_S if at < total else total - (ceil(total / SEGMENT_S) - 1) * SEGMENT_S
        apart = (length + left) / (place * per_mm - made)
        cycles = ceil(CPU * apart)
        level = sum(cycles >= CPU // cutoff for cutoff in CUTOFFS)
        count = int(whole - made) << level
        step = (cycles >> level) / CPU
        ticks.append(now + step * np.arange(1, count + 1))
        increments.append(np.full(count, 8 >> level))
        now, left, made = ticks[-1][-1], (place * per_mm - whole) * apart, whole
    instants, eighths = np.concatenate(ticks), np.cumsum(np.concatenate(increments))
    found = []
    for steps in map(abs, block.steps):
        counted = (eighths * steps + 4 * events - 1) // (8 * events)
        found.append(instants[np.flatnonzero(np.diff(counted, prepend=0))])
    return found


def _ramp(block: Block) -> float:
    """Return the time of a ramp of a line from rest to rest, in seconds."""
    return sqrt(min(block.nominal**2, block.acceleration * block.length)) / block.acceleration


def _place(block: Block, time: float, total: float) -> float:
    """Return how far a line from rest to rest is after a time, in mm."""
    ramp, time, back = _ramp(block), time, total - time
    if time < ramp:
        return block.acceleration * time**2 / 2
    if back < ramp:
        return block.length - block.acceleration * back**2 / 2
    return block.acceleration * ramp**2 / 2 + block.acceleration * ramp * (time - ramp)
