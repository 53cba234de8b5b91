"""Instants of steps and of ticks against a trapezoid of speeds in real numbers."""

import json
import os
import random
from collections.abc import Iterable
from dataclasses import dataclass
from math import floor
from pathlib import Path
from typing import TypeVar

import numpy as np

from fresa.clock import CLOCK
from tb.models.profile import Block, ProfileModel
from tools.console import Parser, Progress, check_output, command, say, whole, write_atomically
from tools.processes import pool

from .ideal import FRACTION, STEPS_PER_MM, ideal
from .step_instants import KINDS, Instants, instants
from .step_instants import program as random_program

__all__ = ["Deviation", "Path1D", "deviations", "is_right", "main", "plan", "program",
           "step_summary"]

T = TypeVar("T")

ABOUT = """\
Runs random programs on models that are the gateware to the clock, and compares the instants at
which things come with those of a path of constant accelerations in 80-bit arithmetic, in clocks of
20 ns.

Steps: of programs of G-code, planned as the machine plans them, every rising edge of STEP at the
pins is compared with the instant at which its axis passes to that step; and the tick by which it is
made with its own instant. There are as many programs of each kind: lines; arcs, full circles and
helices in all planes; lines with corners of any angle; short segments of a curve; and fast lines of
up to 3 000 000 steps/s, with drivers that take pulses of 100 ns. All others go at 1 to 450 000
steps/s, with the times of an A4988.

Ticks: of the profile by itself, 64 or so a block: single blocks, and chains in which speeds at
junctions are random, at 1 to 450 000 steps/s, at 40 to 3 200 steps/mm; it takes 5 ms to 2 s to get
there. After the half clock in which the first phase begins.

Exit status 1 if a tick of a step is more than two clocks from its instant, or if a motion from rest
begins more than two clocks from the instant at which the one before ends. Instants count from the
begin of such a motion: where the speed does not come down to 0, what a block is off adds to the
next.
"""

EPILOG = """\
examples:
  python -m benchmarks.step_times
  python -m benchmarks.step_times --steps 1000 --json times.json
      A thousand programs of G-code: some six minutes of a core.
  python -m benchmarks.step_times --steps 0 --programs 1000 --blocks 1
      Ticks alone.
"""

MOST_APART = 2
"""Clocks from its instant within which the tick of a step comes, and a motion from rest begins."""

PERCENT = (50, 99, 99.9)
"""Parts of all steps of which figures say how far apart at most they are."""


@dataclass(frozen=True)
class Path1D:
    """A block as a planner has it: length in nm / 256, acceleration in nm/s², speed in nm/s."""

    length: int
    acceleration: int
    speed: int

    def block(self) -> Block:
        """Return it as the profile takes it: with the fewest ticks of 4 clocks at most."""
        path = self.length * CLOCK << FRACTION - 8
        log2_ticks = 0
        while path >> log2_ticks >= 4 * self.speed << FRACTION:
            log2_ticks += 1
        return Block(energy=(2 * self.acceleration * self.length >> 8) >> log2_ticks,
                     modulus=path >> log2_ticks, nominal=self.speed**2, log2_ticks=log2_ticks)


@dataclass
class Deviation:
    """Deviations of a program, in clocks.

    Attributes
    ----------
    least, most : float
        Of a tick from its ideal instant.
    ends : list of float
        Of the last tick of each block.
    clocks, late : int
        Length, and granules that began late.
    granules : (int, int)
        Shortest and longest granule of more than a tick.
    """

    least: float
    most: float
    ends: list[float]
    clocks: int
    late: int
    granules: tuple[int, int]


def program(rng: random.Random, blocks: int) -> list[Path1D]:
    """Make a random program."""
    steps_per_mm = rng.choice(STEPS_PER_MM)
    top = min(450_000.0, 10 ** rng.uniform(0, np.log10(450_000)), steps_per_mm * 2000.0)
    nm = 1_000_000 / steps_per_mm
    acceleration = int(top / 10 ** rng.uniform(-2.3, 0.3) * nm) + 1
    made = []
    while len(made) < blocks:
        speed = top * rng.uniform(0.3, 1)
        steps = max(1, floor(speed * 10 ** rng.uniform(-1.5, 0.8) / blocks**0.5))
        length = int(steps * nm * 256)
        path = Path1D(length, acceleration,
                      max(1, min(int(speed * nm) + 1, length * CLOCK // (128 * 256))))
        if path.block().energy < 2:
            return program(rng, blocks)  # no other path that slow would have more
        made.append(path)
    return made


def plan(rng: random.Random, paths: list[Path1D]) -> list[int]:
    """Return the squares at the ends of blocks: as high as they may be, or less."""
    blocks = [path.block() for path in paths]
    ends = [0]
    for block, following in zip(blocks[-2::-1], blocks[:0:-1], strict=True):
        limit = min(block.nominal, following.nominal)
        if rng.random() < 0.25:
            limit = int(limit * rng.random())
        ends.append(min(limit, ends[-1] + (following.energy << following.log2_ticks)))
    ends.reverse()
    begin = 0
    for place, block in enumerate(blocks):  # no faster than it can get there
        begin = ends[place] = min(ends[place], begin + (block.energy << block.log2_ticks))
    return ends


def deviations(paths: list[Path1D], ends: list[int], samples: int = 64) -> Deviation:
    """Run a program on the model, and compare some ticks of each block."""
    blocks = [path.block() for path in paths]
    model = ProfileModel([(block, 0) for block in blocks], lambda number, _: ends[number],
                         fraction_bits=FRACTION)
    least, most, last = np.inf, -np.inf, []
    shortest, longest, step = 1 << 60, 0, 1
    origin, begin, done = np.longdouble(0), 0, 0
    ticks: list[int] = []
    clocks: list[int] = []
    for granule in model.granules(merge=True):
        if granule.first:
            done, ticks, clocks = 0, [], []
            step = max(1, (1 << blocks[granule.block].log2_ticks) // samples)
            if granule.block == 0:
                origin += granule.began
        for tick in range(step - done % step, granule.size + 1, step):
            ticks.append(done + tick)
            clocks.append(granule.clock(tick))
        done += granule.size
        if granule.rate and 1 < granule.size <= 32:
            shortest = min(shortest, granule.ended - granule.began)
            longest = max(longest, granule.ended - granule.began)
        if granule.last:
            assert granule.square == ends[granule.block] and done == ticks[-1]
            unit = (np.longdouble(paths[granule.block].length) / 256 * CLOCK
                    / (1 << blocks[granule.block].log2_ticks))
            found = ideal(blocks[granule.block], unit, begin, ends[granule.block], np.array(ticks))
            by = np.array(clocks, np.longdouble) - origin - found
            least, most = min(least, float(by.min())), max(most, float(by.max()))
            last.append(float(by[-1]))
            origin, begin = origin + found[-1], ends[granule.block]
    return Deviation(least, most, last, clocks[-1], model.late, (shortest, longest))


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.step_times", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--steps", type=whole(0, 10**6), default=20, metavar="N",
                        help="programs of G-code, a fifth of each kind (default: %(default)s)")
    parser.add_argument("--programs", type=whole(0, 10**6), default=20, metavar="N",
                        help="programs for ticks, of each number of blocks (default: %(default)s)")
    parser.add_argument("--blocks", type=int, action="append", metavar="N",
                        help="blocks of such a program; may be repeated (default: 1 and 30)")
    parser.add_argument("--jobs", type=whole(1, 1000), default=os.cpu_count(), metavar="N",
                        help="processes (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="(default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    check_output(args.json)
    figures = {"steps": {}, "ticks": {}}
    sizes = args.blocks or [1, 30]
    each = max(1, args.steps // len(KINDS)) if args.steps else 0
    total = each * len(KINDS) + args.programs * len(sizes)
    with pool(args.jobs) as running, Progress(total, "programs", "moving") as progress:
        for kind in KINDS if each else ():
            steps = _advanced(progress, running.map(
                steps_of, [kind] * each,
                [f"{args.seed} {kind} {number}" for number in range(each)]))
            figures["steps"][kind] = figure = step_summary(steps)
            say(f"{kind:8} {step_line(figure)}")
        for blocks in sizes if args.programs else ():
            ticks = _advanced(progress, running.map(
                ticks_of, [blocks] * args.programs,
                [f"{args.seed} {blocks} {number}" for number in range(args.programs)]))
            figures["ticks"][str(blocks)] = figure = summary(ticks)
            say(f"{blocks} blocks: {line(figure)}")
    good = all(map(is_right, figures["steps"].values()))
    if args.json:
        text = json.dumps({"seed": args.seed, "good": good, **figures}, indent=1)
        write_atomically(args.json, f"{text}\n".encode())
    return 0 if good else 1


def ticks_of(blocks: int, seed: str) -> Deviation:
    """Make a random program of so many blocks, and compare its ticks."""
    rng = random.Random(seed)
    paths = program(rng, blocks)
    return deviations(paths, plan(rng, paths))


def steps_of(kind: str, seed: str) -> Instants:
    """Make a random program of a kind, and compare its steps."""
    return instants(random_program(kind, random.Random(seed)))


def _advanced(progress: Progress, found: Iterable[T]) -> list[T]:
    """Collect what is found, and show that it is."""
    kept = []
    for each in found:
        kept.append(each)
        progress.advance()
    return kept


def step_summary(found: list[Instants]) -> dict:
    """Return the figures of programs of one kind.

    Of clocks, of shares of the time to the nearest step, and of ticks these are the least, those
    below which 50, 99 and 99.9 of a hundred steps are, and the most; of begins the least and the
    most, with 0 among them.
    """
    def spread(parts: Iterable[np.ndarray], digits: int) -> list[float]:
        values = np.concatenate([*parts])
        return [round(float(each), digits) for each in np.percentile(values, (0, *PERCENT, 100))]

    rates = [each.rate for each in found]
    begins = np.concatenate([np.zeros(1), *(each.begins for each in found)])
    return {
        "programs": len(found), "blocks": sum(each.blocks for each in found),
        "steps": sum(len(each.by) for each in found),
        "seconds": round(sum(each.seconds for each in found), 1),
        "rates": [round(min(rates), 1), round(max(rates))],
        "fastest": round(max(each.fastest for each in found)),
        "clocks": spread((each.by for each in found), 1),
        "share": spread((each.share for each in found), 4),
        "tick_clocks": spread((each.ticks for each in found), 2),
        "begins": [round(float(extreme), 2) for extreme in (begins.min(), begins.max())],
        "late": sum(each.late for each in found),
        "cancelled": sum(each.cancelled for each in found)}


def is_right(figure: dict) -> bool:
    """Return whether ticks of steps, and begins, are as near to their instants as they should."""
    return all(abs(each) <= MOST_APART for each in figure["tick_clocks"] + figure["begins"])


def step_line(figure: dict) -> str:
    """Return the figures as a line."""
    low, *middle, high = figure["clocks"]
    return (f"{figure['programs']} programs, {figure['steps']} steps at up to "
            f"{figure['fastest']} a second: {low:+.1f} to {high:+.1f} clocks, "
            + ", ".join(f"p{name:g} {value:+.1f}" for name, value in zip(
                PERCENT, middle, strict=True))
            + f"; p99.9 is {figure['share'][3]:.1%} of the time to the next step; ticks "
            f"{figure['tick_clocks'][0]:+.2f} to {figure['tick_clocks'][-1]:+.2f}, begins "
            f"{figure['begins'][0]:+.2f} to {figure['begins'][1]:+.2f}")


def summary(found: list[Deviation]) -> dict:
    """Return the figures of programs of as many blocks."""
    worst = np.array([max(-each.least, each.most) for each in found])
    p50, p90, p99 = (round(float(part), 2) for part in np.percentile(worst, [50, 90, 99]))
    return {
        "programs": len(found), "least": round(min(each.least for each in found), 2),
        "most": round(max(each.most for each in found), 2), "p50": p50, "p90": p90, "p99": p99,
        "ends": [round(extreme(end for each in found for end in each.ends), 2)
                 for extreme in (min, max)],
        "granules": [min(each.granules[0] for each in found),
                     max(each.granules[1] for each in found)],
        "late": sum(each.late for each in found),
        "seconds": round(sum(each.clocks for each in found) / CLOCK, 1),
        "longest_clocks": max(each.clocks for each in found)}


def line(figure: dict) -> str:
    """Return the figures as a line."""
    low, high = figure["ends"]
    return (f"{figure['programs']} programs, {figure['seconds']} s of movement: "
            f"{figure['least']:+.2f} to {figure['most']:+.2f} clocks, at the ends of blocks "
            f"{low:+.2f} to {high:+.2f}; worst of a program: p50 {figure['p50']}, "
            f"p90 {figure['p90']}, p99 {figure['p99']}; granules {figure['granules'][0]} to "
            f"{figure['granules'][1]} clocks, {figure['late']} late")


if __name__ == "__main__":
    raise SystemExit(main())
