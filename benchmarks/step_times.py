"""Instants of ticks against a trapezoid of speeds in real numbers."""

import json
import random
from dataclasses import dataclass
from math import floor
from pathlib import Path

import numpy as np

from fresa.clock import CLOCK
from tb.models.profile import Block, ProfileModel
from tools.console import Parser, Progress, check_output, command, say, write_atomically

__all__ = ["Deviation", "Path1D", "deviations", "main", "plan", "program"]

ABOUT = """\
Moves along random paths with the model of the speed profile, which is that of the gateware to the
clock, and compares the instants of its ticks, 64 or so a block, with those of a path of constant
accelerations in extended precision: single blocks, and chains in which speeds at junctions are
random. Top speeds are 1 to 450 000 steps/s, at 40 to 3 200 steps/mm; it takes 5 ms to 2 s to get
there. Prints the deviation in clocks: after the half clock in which the first phase begins.
"""

EPILOG = """\
examples:
  python -m benchmarks.step_times
  python -m benchmarks.step_times --programs 1000 --blocks 1
  python -m benchmarks.step_times --programs 60 --blocks 30 --json times.json
"""

FRACTION = 16
"""Bits of the fraction of speeds."""

STEPS_PER_MM = (40, 80, 160, 250, 400, 1000, 3200)


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
        if path.block().energy >= 2:
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


def ideal(path: Path1D, begin: int, end: int, ticks: np.ndarray) -> np.ndarray:
    """Return the exact clocks of ticks, from the begin of a block, between two squared speeds."""
    block = path.block()
    real = np.longdouble
    energy, first, last = real(block.energy), real(begin), real(end)
    count, top = real(1 << block.log2_ticks), real(block.nominal)
    rises = (last - first + energy * count) / (2 * energy)
    falls = rises
    peak = first + energy * rises
    if peak > top:
        rises, falls = (top - first) / energy, count - (top - last) / energy
        peak = top
    unit = real(path.length) / 256 * CLOCK / count

    def ramp(square, made):  # from this square up or, backwards, down to it
        root = np.sqrt(square) + np.sqrt(np.maximum(square + energy * made, 0))
        return np.divide(2 * made, root, out=np.zeros_like(made), where=made > 0)

    n = ticks.astype(real)
    up, down = np.minimum(n, rises), np.maximum(n - falls, 0)
    level = np.minimum(np.maximum(n - rises, 0), falls - rises)
    before = ramp(last, np.full_like(n, count - falls)) - ramp(last, count - falls - down)
    return unit * (ramp(first, up) + level / np.sqrt(peak) + before)


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
            found = ideal(paths[granule.block], begin, ends[granule.block], np.array(ticks))
            by = np.array(clocks, np.longdouble) - origin - found
            least, most = min(least, float(by.min())), max(most, float(by.max()))
            last.append(float(by[-1]))
            origin, begin = origin + found[-1], ends[granule.block]
    return Deviation(least, most, last, clocks[-1], model.late, (shortest, longest))


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.step_times", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--programs", type=int, default=20, metavar="N",
                        help="programs of each kind (default: %(default)s)")
    parser.add_argument("--blocks", type=int, action="append", metavar="N",
                        help="blocks of a program; may be repeated (default: 1 and 30)")
    parser.add_argument("--seed", type=int, default=1, help="(default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    check_output(args.json)
    figures = {}
    sizes = args.blocks or [1, 30]
    with Progress(args.programs * len(sizes), "programs", "moving") as progress:
        for blocks in sizes:
            found = []
            for number in range(args.programs):
                rng = random.Random(f"{args.seed} {blocks} {number}")
                paths = program(rng, blocks)
                found.append(deviations(paths, plan(rng, paths)))
                progress.advance()
            figures[str(blocks)] = figure = summary(found)
            say(f"{blocks} blocks: {line(figure)}")
    if args.json:
        write_atomically(args.json, (json.dumps(figures, indent=1) + "\n").encode())
    return 0


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
