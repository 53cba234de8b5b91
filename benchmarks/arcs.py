"""Arcs of the walk against the true circle, for random radii, angles and steps per metre."""

import json
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tb.models.walk import half_turns
from tools.console import (
    Parser,
    Progress,
    check_output,
    command,
    known,
    say,
    whole,
    write_atomically,
)

__all__ = ["Figures", "main", "measure"]

ABOUT = """\
Makes random arcs on the model of the walk, whose half turns are those of the gateware to the bit:
radii from 0.06 to 500 mm, 40 to 3200 steps/mm, a quarter of them full circles, and starts anywhere
between two steps. Prints the median, the 99th of 100 and the worst of these figures of an arc:

  grid    distance of a requested grid point from the true circle, in steps of the coarser axis
  sync    distance of an axis from the true point of the moment of a step, in its own steps
  end     distance of the rounded true end from an axis, before the corrective step, in its steps
  ripple  of the speed along the arc, peak to peak, over its mean

and how many ends needed a corrective step, and how many needed more than one, which must be none.
Arcs that take more half turns than --turns are cut short.

The exit status is 1 if a grid point is a step or more off the circle, if an end takes more than one
corrective step, or if the speed has a ripple of 1 % or more.
"""

EPILOG = """\
examples:
  python -m benchmarks.arcs
  python -m benchmarks.arcs unequal --arcs 1000 --turns 20000
  python -m benchmarks.arcs --json arcs.json
"""

RATIOS = (40_000, 78_740, 80_000, 160_000, 250_000, 1_000_000, 3_200_000)  # steps/m
SETTINGS = ("equal", "unequal")
NAMES = ("grid", "sync", "end", "ripple")


@dataclass
class Figures:
    """What arcs have come to.

    Attributes
    ----------
    arcs, turns, steps : int
        Arcs, their half turns and their steps.
    grid, sync, end, ripple : list of float
        Of each arc, see ``--help``.
    corrective, beyond : int
        Ends of axes that take one corrective step; that would take more.
    """

    arcs: int
    turns: int
    steps: int
    grid: list[float]
    sync: list[float]
    end: list[float]
    ripple: list[float]
    corrective: int
    beyond: int


class _Arcs:
    """Arcs side by side, an element of each array for each; lengths are in steps of their axes."""

    def __init__(self, count: int, most: int, equal: bool, rng: np.random.Generator) -> None:
        pair = np.sort(rng.choice(RATIOS, (2, count)), axis=0)
        self.coarse, self.fine = (pair[1], pair[1]) if equal else pair
        self.radius = 10 ** rng.uniform(np.log10(6e-5), np.log10(0.5), count)  # m
        unit = np.maximum(1, np.ceil(np.log2(self.radius * self.fine))).astype(np.int64)
        self.shift = unit + 3
        half = np.arcsin(2.0 ** -(unit + 4))
        angle = np.where(rng.random(count) < 0.25, 2 * pi, rng.uniform(0.001, 2 * pi, count))
        angle = np.minimum(angle, most * half)
        self.turns = np.maximum(1, np.rint(angle / half)).astype(np.int64)
        self.clockwise = rng.integers(0, 2, count)
        self.angle = np.where(self.clockwise, -angle, angle)
        self.begin = rng.uniform(0, 2 * pi, count)
        scale = self.fine / 2.0**unit * 2.0**34 * self.radius
        self.x = np.rint(scale * np.cos(self.begin)).astype(np.int64)
        self.y = np.rint(scale * np.sin(self.begin)).astype(np.int64)
        self.per = np.stack([self.fine, self.coarse])  # steps/m of u and v
        # Position + 1/2 step at the start, as the planner gives it: the walk counts from its floor.
        self.start = rng.random((2, count))
        self.centre = self.start - 0.5 - self.radius * self.per * _unit(self.begin)
        self.residual = np.floor(self.start[1] * 4 * self.fine).astype(np.int64)
        self.sums = np.stack([np.floor(self.start[0] * 256).astype(np.int64),
                              32 - (self.x >> 30)]) << 36
        self.place = np.zeros((2, count), np.int64)

    def true(self, angle: NDArray, chosen: NDArray) -> NDArray:
        """Return the true point of some arcs, as a row for u and one for v."""
        return (self.centre[:, chosen] + self.radius[chosen] * self.per[:, chosen] * _unit(angle))

    def move(self, channel: int, distance: NDArray, active: NDArray) -> NDArray:
        """Add to a channel; return the arcs of which it makes a step."""
        self.sums[channel] += np.where(active, distance, 0)
        if channel == 0:
            place = self.sums[0] >> 44
        else:
            # Quarter steps are counted from the one of the start, and go back in a mirrored arc.
            quarters = self.sums[1] >> 42
            quarters = np.where(self.clockwise, -quarters, quarters)
            place = (self.residual + quarters * self.coarse) // (4 * self.fine)
        stepped = np.flatnonzero(place != self.place[channel])
        self.place[channel] = place
        return stepped


def _unit(angle: NDArray) -> NDArray:
    return np.stack([np.cos(angle), np.sin(angle)])


def measure(count: int, most: int, *, equal: bool, seed: int = 0, done=lambda turns: None
            ) -> Figures:
    """Measure random arcs.

    Parameters
    ----------
    count, most : int
        How many arcs, and of how many half turns at most.
    equal : bool
        Both axes have the same steps per metre.
    seed : int
        Of the random numbers.
    done : callable
        Called now and then with the number of half turns since the last time.
    """
    arcs = _Arcs(count, most, equal, np.random.default_rng(seed))
    grid, sync = np.zeros(count), np.zeros(count)
    low, high = np.full(count, np.inf), np.zeros(count)
    angle = arcs.angle / arcs.turns
    before = last = np.zeros(count)
    steps, longest = 0, int(arcs.turns.max())
    for turn, (channel, distance) in enumerate(
            half_turns(arcs.x, arcs.y, arcs.shift, arcs.clockwise, longest)):
        active = turn < arcs.turns
        stepped = arcs.move(channel, distance, active)
        if stepped.size:
            steps += stepped.size
            now = arcs.begin[stepped] + angle[stepped] * turn
            here, per = arcs.place[:, stepped], arcs.per[:, stepped]
            away = np.hypot(*((here - arcs.centre[:, stepped]) / per)) - arcs.radius[stepped]
            np.maximum.at(grid, stepped, np.abs(away) * arcs.coarse[stepped])
            np.maximum.at(sync, stepped,
                          np.abs(here - arcs.true(now, stepped)).max(axis=0))
        if channel == 0:
            last = distance
        else:
            if turn > 1:
                speed = np.hypot(last.astype(float), (before + distance) / 2)
                low = np.where(active, np.minimum(low, speed), low)
                high = np.where(active, np.maximum(high, speed), high)
            before = distance
        if turn % 1000 == 999:
            done(1000)
    done(longest % 1000)
    every = np.arange(count)
    off = arcs.true(arcs.begin + arcs.angle, every)
    missing = np.abs(np.floor(off + 0.5).astype(np.int64) - arcs.place)
    ripple = np.where(high > 0, 2 * (high - low) / (high + low), 0)
    return Figures(count, int(arcs.turns.sum()), steps, grid.tolist(), sync.tolist(),
                   np.abs(off - arcs.place).max(axis=0).tolist(), ripple.tolist(),
                   int((missing == 1).sum()), int((missing > 1).sum()))


def lines(name: str, found: Figures) -> list[str]:
    """Return the figures as text."""
    said = [f"{name}: {found.arcs} arcs, {found.turns} half turns, {found.steps} steps; "
            f"{found.corrective} of {2 * found.arcs} ends with a corrective step, "
            f"{found.beyond} with more"]
    for figure in NAMES:
        middle, most, worst = np.percentile(getattr(found, figure), [50, 99, 100])
        said.append(f"  {figure:8}{middle:>12.3g}{most:>12.3g}{worst:>12.3g}")
    return said


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.arcs", description=ABOUT, epilog=EPILOG)
    parser.add_argument("settings", metavar="SETTING", nargs="*",
                        help=f"steps/mm of the two axes: {' or '.join(SETTINGS)}; both")
    parser.add_argument("--arcs", metavar="N", type=whole(1), default=300,
                        help="arcs of a setting (default: %(default)s)")
    parser.add_argument("--turns", metavar="N", type=whole(1), default=100_000,
                        help="half turns of an arc at most (default: %(default)s)")
    parser.add_argument("--seed", metavar="N", type=whole(0), default=0,
                        help="of the random numbers (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    names = [known(name, SETTINGS, "setting") for name in args.settings] or list(SETTINGS)
    check_output(args.json)
    found: dict[str, dict] = {}
    good = True
    say(f"{'':10}{'median':>12}{'99 %':>12}{'worst':>12}")
    with Progress(len(names) * args.turns, "half turns", "walking") as progress:
        for name in names:
            each = measure(args.arcs, args.turns, equal=name == "equal", seed=args.seed,
                           done=progress.advance)
            good = good and not each.beyond and max(each.grid) < 1 and max(each.ripple) < 0.01
            found[name] = vars(each)
            for line in lines(name, each):
                say(line)
    if args.json:
        write_atomically(args.json, (json.dumps(found, indent=1) + "\n").encode())
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
