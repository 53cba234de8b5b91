"""Instants of steps at the pins of the G-code machine, against profiles in real numbers.

A step of a line lies where the place of its axis, which the machine has in 2**-8 of a step, passes
from one step to the next: that is a real number of ticks from the begin of the block. A step of an
arc lies where its half turn begins. The profile in real numbers gives the instant of such a place;
what is compared is the rising edge of STEP at the pin, whose latency behind a tick is constant.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import cos, log10, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tb.models.gcode_blocks import Motion, ProgramModel, corrective
from tb.models.gcode_machine import DELAY, PENDING, pulses
from tb.models.gcode_plan import PlanSettings
from tb.models.plan import junctions
from tb.models.profile import ProfileModel
from tb.models.walk import segment_steps, turn_ticks

from .ideal import FRACTION, STEPS_PER_MM, ideal

__all__ = ["KINDS", "Instants", "Random", "instants", "program"]

CLOCK = 50_000_000
LATENCY = DELAY + 1 + PENDING + 1
"""Clocks from the tick of a line to the rising edge of its step."""

A4988 = {"width": 50, "low": 50, "setup": 10, "hold": 10}
SHORT = {"width": 5, "low": 5, "setup": 1, "hold": 1}
"""Times of drivers in clocks: 1 us and 200 ns, and pulses of 100 ns."""

MOST = 450_000
MOST_SHORT = 3_000_000
"""Steps/s."""

FINE = 8000, 16_000
"""Steps per mm, which 3 000 000 steps/s need."""

STEPS, STEPS_SHORT = 60_000, 120_000
"""About as many steps has the longest program."""


@dataclass(frozen=True)
class Random:
    """A random program: a machine, the times of its drivers, lines, and its highest rate."""

    settings: PlanSettings
    driver: dict[str, int]
    lines: list[str]
    rate: float


@dataclass(frozen=True)
class Instants:
    """What came of a program.

    Attributes
    ----------
    by : array of float
        By how many clocks each step is later than its ideal instant.
    share : array of float
        The same as a share of the time to the nearest step of its axis, before or behind it.
    ticks : array of float
        By how many clocks the tick of each step is later than its own ideal instant.
    begins : array of float
        By how many clocks each motion from rest, but the first, begins later than the one before
        ends in the ideal profile.
    rate : float
        The highest rate of the machine, in steps/s.
    fastest : float
        That of two steps of an axis in the program, in steps/s.
    seconds : float
        How long it moves.
    blocks, late, cancelled : int
        Blocks; granules of the profile that began late; steps that made no edge, as the axis turned
        round before a driver could make them.
    """

    by: NDArray[np.float64]
    share: NDArray[np.float64]
    ticks: NDArray[np.float64]
    begins: NDArray[np.float64]
    rate: float
    fastest: float
    seconds: float
    blocks: int
    late: int
    cancelled: int


class _Maker:
    """Makes the lines of a program, of lengths that are given in steps of the finest axis."""

    def __init__(self, rng: random.Random, rate: float, per_mm: Sequence[int], seconds: float,
                 blocks: int, most: int) -> None:
        self.rng, self.blocks = rng, blocks
        self.fine, self._most = max(per_mm), most / blocks
        self._ramp = rate * seconds  # twice the steps in which it gets there
        self.lines = [f"G91G21G17G1F{60 * rate / self.fine:.4f}"]

    def length(self, least: float = 1) -> float:
        """Return a length in mm."""
        steps = self._ramp * 10 ** self.rng.uniform(-1.3, 0.7) / self.blocks**0.5
        return min(max(steps, least * self.rng.uniform(1, 4)), self._most) / self.fine

    def move(self, word: str, *way: float) -> None:
        """Add a line by so many mm."""
        self.lines.append(word + "".join(
            f"{axis}{by:.6f}" for axis, by in zip("XYZ", way, strict=False) if by))


def _lines(make: _Maker) -> None:
    """Lines there and back again, of one, two or three axes."""
    rng = make.rng
    while len(make.lines) <= make.blocks:
        length, axes = make.length(), rng.sample(range(3), rng.choice([1, 1, 2, 3]))
        way = [length * rng.choice([-1, 1]) * rng.uniform(0.1, 1) * (axis in axes)
               for axis in range(3)]
        make.move("G0", *way)
        if rng.random() < 0.5:
            make.move("G0", *(-each for each in way))


def _corners(make: _Maker) -> None:
    """Lines with corners of any angle between them."""
    rng, angle = make.rng, 0.0
    for _ in range(make.blocks):
        angle += rng.choice([rng.gauss(0, 0.1), rng.gauss(0, 1), rng.uniform(-pi, pi), pi / 2])
        length = make.length()
        make.move(rng.choice(["G0", "G1"]), length * cos(angle), length * sin(angle),
                  length * rng.choice([0, 0, rng.uniform(-0.5, 0.5)]))


def _short(make: _Maker) -> None:
    """Short segments of a curve, most of a few steps, some of less than one."""
    rng, angle = make.rng, make.rng.uniform(0, 2 * pi)
    length = 10 ** rng.uniform(-0.5, 1.7) / make.fine
    for _ in range(make.blocks):
        angle += rng.gauss(0, 0.05)
        by = max(length * rng.uniform(0.5, 1.5), 2e-6)
        make.move("G1", by * cos(angle), by * sin(angle))


def _arcs(make: _Maker) -> None:
    """Arcs, full circles and helices in all planes, with lines between them."""
    rng = make.rng
    for _ in range(make.blocks):
        plane, axes, offsets = rng.choice([("G17", "XYZ", "IJ"), ("G18", "ZXY", "KI"),
                                           ("G19", "YZX", "JK")])
        sweep = rng.choice([2 * pi, rng.uniform(0.2, 6)])
        radius, begin = max(make.length(20) / sweep, 0.003), rng.uniform(0, 2 * pi)
        clockwise = rng.random() < 0.5
        end = begin + (-sweep if clockwise else sweep)
        centre = f"{offsets[0]}{-radius * cos(begin):.6f}{offsets[1]}{-radius * sin(begin):.6f}"
        change = [radius * (f(end) - f(begin)) for f in (cos, sin)]
        to = ("".join(f"{axis}{by:.6f}" for axis, by in zip(axes, change, strict=False))
              if sweep < 2 * pi else f"{axes[0]}0")
        if rng.random() < 0.3:
            to += f"{axes[2]}{rng.uniform(-1, 1) * radius:.6f}"
        make.lines.append(f"{plane}{'G2' if clockwise else 'G3'}{to}{centre}")
        if rng.random() < 0.3:
            make.move("G1", make.length())


KINDS: dict[str, tuple[Callable[[_Maker], None], int]] = {
    "lines": (_lines, 4), "arcs": (_arcs, 6), "corners": (_corners, 24), "short": (_short, 60),
    "fast": (_lines, 2)}
"""What makes programs of each kind, and of about how many blocks."""


def program(kind: str, rng: random.Random) -> Random:
    """Make a random program: its highest rates are spread evenly over their logarithm."""
    make, blocks = KINDS[kind]
    fast = kind == "fast"
    most = MOST_SHORT if fast else MOST
    rate = most ** rng.uniform(0.8, 1) if fast else 10 ** rng.uniform(0, log10(most))
    if rng.random() < 0.1:
        rate = float(most)
    fits = FINE if fast else [each for each in STEPS_PER_MM if rate * 10**6 / each < 1 << 31]
    per_mm = [rng.choice(fits) for _ in range(3)]
    if rng.random() < 0.5:
        per_mm = [per_mm[0]] * 3
    steps = STEPS_SHORT if fast else STEPS
    seconds = 0.005 * min(60, max(1, 100 * steps / rate)) ** rng.random()  # to reach this rate
    speeds = [max(2, int(rate * 10**6 / each)) for each in per_mm]
    settings = PlanSettings(
        clock=CLOCK, speeds=speeds,
        accelerations=[min(max(int(speed / seconds) + 2, 8 * CLOCK // min(speeds)), 17 * 10**9)
                       for speed in speeds],  # the profile needs two units of energy a tick
        steps=[1000 * each for each in per_mm], deviation=int(10 ** rng.uniform(3, 5)))
    maker = _Maker(rng, rate, per_mm, seconds, blocks, steps)
    make(maker)
    return Random(settings, SHORT if fast else A4988, maker.lines, rate)


def _wanted(block: Motion) -> list[list[tuple[int, np.longdouble]]]:
    """Return of each channel the tick of each step, and where it lies in a real number of ticks."""
    segment = block.segment
    made = segment_steps(segment, block.fine, block.coarse)
    count = 1 << segment.log2_ticks
    places: list[list[tuple[int, np.longdouble]]] = []
    real = np.longdouble
    turn_of = {tick: turn for turn, tick in enumerate(turn_ticks(
        segment.turns, segment.log2_ticks))} if segment.arc else {}
    for channel, steps in enumerate(made):
        start, increment = segment.start[channel], segment.increment[channel]
        if segment.arc and channel < 2:
            places.append([(tick, real(turn_of[tick] * count) / segment.turns)
                           for tick, _ in steps])
        else:
            ends = [(number << 8) - start if increment > 0 else (number - 1 << 8) + start
                    for number in range(1, len(steps) + 1)]
            places.append([(tick, real(end * count) / abs(increment))
                           for (tick, _), end in zip(steps, ends, strict=True)])
    return places


def _block_ticks(profile: ProfileModel, blocks: Sequence[Motion], wanted: Sequence[Sequence[int]],
                 begins: list[int]) -> Iterator[dict[int, int]]:
    """Yield of each block the clocks of the ticks that are wanted, in ascending order."""
    place, done, clocks = 0, 0, {}
    for granule in profile.granules(merge=True):
        if granule.first:
            place, done, clocks = 0, 0, {}
            begins.append(granule.began)
        ticks = wanted[granule.block]
        end = done + granule.size
        if place < len(ticks) and ticks[place] <= end:
            known = granule.clocks(profile.backlog) if granule.size <= 32 else None
            while place < len(ticks) and ticks[place] <= end:
                tick = ticks[place] - done
                clocks[ticks[place]] = known[tick - 1] if known else granule.clock(tick)
                place += 1
        done = end
        if granule.last:
            yield clocks


def instants(made: Random) -> Instants:
    """Run a program on the model of the machine, and compare each of its steps."""
    model = ProgramModel(made.settings)
    blocks = []
    for line in made.lines:
        answer, found = model.line(line)
        if answer != "ok":
            raise RuntimeError(f"{line} is answered {answer}")
        blocks += [block for block in found if isinstance(block, Motion)]
    blocks = blocks[:63]
    squares = junctions([(block.limit, block.gain) for block in blocks])
    profile = ProfileModel([(block.profile, 0) for block in blocks],
                           lambda number, _: squares[number + 1])
    every = [_wanted(block) for block in blocks]
    ticks = [sorted({1 << block.segment.log2_ticks, *turn_ticks(
        block.segment.turns, block.segment.log2_ticks),
        *(tick for channel in own for tick, _ in channel)})
        for block, own in zip(blocks, every, strict=True)]
    requests: list[list[tuple[int, int, Any]]] = [[], [], []]  # clock, way, ideal instant
    by_tick: list[NDArray[np.float64]] = []
    begins: list[int] = []
    begins_by: list[float] = []
    origin, before, corrections = np.longdouble(0), -10**6, []
    clocks_of = _block_ticks(profile, blocks, ticks, begins)
    for number, (block, own, clocks) in enumerate(zip(blocks, every, clocks_of, strict=True)):
        if squares[number] == 0:  # deviations do not add up across a rest
            if number:
                begins_by.append(float(begins[number] - origin))
            origin = np.longdouble(begins[number])
        segment, count = block.segment, 1 << block.segment.log2_ticks
        unit = np.longdouble(block.profile.modulus) / (1 << FRACTION)
        steps = segment_steps(segment, block.fine, block.coarse)
        turned = _turned(block, clocks, before + DELAY + 1)
        for axis, channel in enumerate(segment.channel):
            if not own[channel]:
                continue
            at = np.array([place for _, place in own[channel]])
            exact = origin + ideal(block.profile, unit, squares[number], squares[number + 1], at)
            made_by = np.array([tick for tick, _ in steps[channel]])
            own_ticks = origin + ideal(block.profile, unit, squares[number], squares[number + 1],
                                       made_by)
            by_tick.append((np.array([clocks[tick] for tick, _ in steps[channel]])
                            - own_ticks).astype(np.float64))
            for (tick, way), instant in zip(steps[channel], exact, strict=True):
                if segment.arc and channel < 2:
                    clock = turned[tick] + (3 if channel else 1)
                else:
                    clock = clocks[tick] + DELAY + 1
                requests[axis].append((clock, way, instant))
        before = clocks[count]
        for axis, channel in enumerate(segment.channel):
            step = corrective(block.steps[axis], sum(way for _, way in steps[channel]))
            if step:
                corrections.append((before + DELAY + 3, axis, step))
        origin += ideal(block.profile, unit, squares[number], squares[number + 1],
                        np.array([count]))[-1]
    edges = [_edges(own, axis, corrections, made.driver) for axis, own in enumerate(requests)]
    by, share = (np.concatenate([each[place] for each in edges]) for place in (0, 1))
    ticks_by = np.concatenate([np.zeros(0), *by_tick])
    return Instants(by, share, ticks_by, np.array(begins_by), made.rate,
                    max(each[2] for each in edges), (before - begins[0]) / CLOCK, len(blocks),
                    profile.late, sum(each[3] for each in edges))


def _turned(block: Motion, clocks: dict[int, int], loaded: int) -> dict[int, int]:
    """Return when the half turns of an arc are made, by their tick."""
    made, free = {}, loaded
    if block.segment.arc:
        for tick in turn_ticks(block.segment.turns, block.segment.log2_ticks):
            made[tick] = now = max(clocks[tick] + 2, free)
            free = now + 2
    return made


def _edges(requests: list[tuple[int, int, Any]], axis: int,
           corrections: Sequence[tuple[int, int, int]], driver: dict[str, int]
           ) -> tuple[NDArray[np.float64], NDArray[np.float64], float, int]:
    """Compare the edges of an axis, for `Instants`: `by`, `share`, the highest rate, `cancelled`.

    Steps that correct the end of an arc belong to no instant.
    """
    taken = {clock for clock, *_ in requests}
    ordered = list(requests)
    for clock, of, way in corrections:
        if of == axis:
            while clock in taken:
                clock += 1
            taken.add(clock)
            ordered.append((clock, way, np.longdouble(np.nan)))
    ordered.sort(key=lambda each: each[0])
    edges = pulses([(clock + PENDING, way) for clock, way, _ in ordered], **driver)
    kept = _kept(ordered, edges) if len(edges) < len(ordered) else ordered
    clocks = np.array([clock for clock, _ in edges], np.longdouble)
    exact = np.array([instant for *_, instant in kept], np.longdouble)
    by = (clocks - LATENCY - exact).astype(np.float64)
    gaps = np.concatenate([[np.inf], np.diff(clocks).astype(np.float64), [np.inf]])
    share = by / np.minimum(gaps[:-1], gaps[1:])
    right = ~np.isnan(by)
    return by[right], share[right], CLOCK / gaps.min(), len(ordered) - len(edges)


def _kept(ordered: Sequence[tuple[int, int, Any]], edges: Sequence[tuple[int, int]]
          ) -> list[tuple[int, int, Any]]:
    """Return the request that each edge is of: one back cancels the last forward that waits."""
    kept: list[tuple[int, int, Any]] = []
    waiting: list[tuple[int, int, Any]] = []
    place = 0
    for edge, _ in edges:
        while place < len(ordered) and ordered[place][0] + PENDING < edge:
            request = ordered[place]
            place += 1
            if waiting and waiting[-1][1] != request[1]:
                waiting.pop()
            else:
                waiting.append(request)
        kept.append(waiting.pop(0))
    return kept
