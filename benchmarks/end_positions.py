"""Where the axes are after many blocks, against exact arithmetic on the text of the program."""

import json
import random
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from fractions import Fraction
from itertools import islice
from math import cos, floor, pi, sin
from pathlib import Path

import numpy as np

from tb.models.gcode_blocks import Motion, ProgramModel
from tb.models.gcode_ends import moved
from tb.models.gcode_plan import PlanSettings
from tools.console import Parser, Progress, check_output, command, say, whole, write_atomically

__all__ = ["Figures", "Program", "exact_steps", "main", "measure"]

ABOUT = """\
Runs a random program on the model of the G-code machine, which is that of the gateware to the bit:
from each line to its block, and from the block to the steps of the three axes. After each line the
axes must be at the step nearest to where the text of the program says, in rational numbers that are
never rounded, for all lines so far. Lines are absolute and relative, in mm and in inches; arcs and
helices in all planes are turned half turn by half turn. An axis has 80, one 78.74 and one 400
steps/mm, so that most ends are between two steps.

Exit status 1 if an axis is ever a step off.
"""

EPILOG = """\
examples:
  python -m benchmarks.end_positions
  python -m benchmarks.end_positions --blocks 1000000 --json ends.json
      A million: some minutes.

see also: benchmarks.gcode for ends at the pins, benchmarks.arcs for what arcs do on their way.
"""

STEPS = (80_000, 78_740, 400_000)
"""Per metre."""

SETTINGS = PlanSettings(clock=50_000_000, speeds=(200_000_000, 200_000_000, 50_000_000),
                        accelerations=(1_000_000_000, 1_000_000_000, 200_000_000), steps=STEPS,
                        deviation=10_000)

CHUNK = 20_000
"""Lines whose ends are computed at once."""

REACH = 150.0
"""In mm; a program that is further out goes back."""

WORD = re.compile(r"([A-Z])([-+]?[0-9.]+)")


@dataclass(frozen=True)
class Figures:
    """What a program has come to.

    Attributes
    ----------
    lines, blocks, arcs : int
        Lines of text, blocks of motion, and those of them that are arcs.
    steps : int
        Sum of the distances between ends, in steps of each axis.
    off, most : int
        Lines after which an axis is not at the right step, and by how many steps at most.
    end : list of int
        Where it ends, in steps.
    """

    lines: int
    blocks: int
    arcs: int
    steps: int
    off: int
    most: int
    end: list[int]


class Program:
    """Makes lines of G-code without end, and knows in rational numbers where each of them ends.

    The numbers are read from the text of the line.

    Parameters
    ----------
    seed : int
        Of the random numbers.
    arcs : float
        Share of lines that are arcs.

    Attributes
    ----------
    position : list of Fraction
        X, Y and Z in mm.
    """

    def __init__(self, seed: int, arcs: float) -> None:
        self.position = [Fraction(0)] * 3
        self._rng = random.Random(seed)
        self._arcs = arcs
        self._relative = self._inches = False
        self._plane = 17

    def lines(self) -> Iterator[str]:
        """Give lines, each after the one before has ended."""
        yield self._read("G21G90G17G1F6000")
        while True:
            draw = self._rng.random()
            if draw < 0.02:
                yield self._read(self._rng.choice(
                    ["G90", "G91", "G20", "G21", "G17", "G18", "G19"]))
            elif max(map(abs, self.position)) > REACH:
                yield self._read("G90G0X0Y0Z0")
            elif draw < 0.02 + self._arcs:
                yield self._read(self._arc())
            else:
                size = self._rng.choice([0.05, 0.1, 0.5, 5])
                yield self._read(self._rng.choice(["G0", "G1", "G1", "G1"]) + self._words(
                    {axis: self._rng.uniform(-size, size) for axis in self._rng.sample(
                        range(3), self._rng.choice([1, 2, 2, 2, 3]))}))

    def _words(self, moves: dict[int, float]) -> str:
        """Return the words of a motion by so many mm."""
        unit, digits = (25.4, 5) if self._inches else (1.0, 4)
        return "".join(f"{'XYZ'[axis]}{(move + self._origin(axis)) / unit:.{digits}f}"
                       for axis, move in moves.items())

    def _origin(self, axis: int) -> float:
        return 0.0 if self._relative else float(self.position[axis])

    def _arc(self) -> str:
        """Return an arc or a helix, at times a full circle."""
        rng = self._rng
        a, b, c = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[self._plane]
        radius, begin = 0.05 * 40**rng.random(), rng.uniform(0, 2 * pi)
        unit, digits = (25.4, 5) if self._inches else (1.0, 4)
        i, j = (f"{-radius * part / unit:.{digits}f}" for part in (cos(begin), sin(begin)))
        if rng.random() < 0.2:
            words = f"G91{'XYZ'[a]}0"  # so its end is its start, exactly
        else:
            end = begin + rng.uniform(0.1, 6)
            moves = {a: radius * (cos(end) - cos(begin)), b: radius * (sin(end) - sin(begin))}
            if rng.random() < 0.3:
                moves[c] = rng.uniform(-radius, radius)
            words = self._words(moves)
        return f"G{rng.choice('23')}{words}{'IJK'[a]}{i}{'IJK'[b]}{j}"

    def _read(self, text: str) -> str:
        """Take the end from the text."""
        for letter, number in WORD.findall(text):
            if letter == "G" and number in ("90", "91"):
                self._relative = number == "91"
            elif letter == "G" and number in ("20", "21"):
                self._inches = number == "20"
            elif letter == "G" and number in ("17", "18", "19"):
                self._plane = int(number)
            elif letter in "XYZ":
                axis = "XYZ".index(letter)
                value = Fraction(number) * (Fraction(127, 5) if self._inches else 1)
                self.position[axis] = value + self.position[axis] * self._relative
        return text


def exact_steps(position: list[Fraction]) -> list[int]:
    """Return the nearest steps, of two the higher."""
    return [floor(at * per_metre / 1000 + Fraction(1, 2))
            for at, per_metre in zip(position, STEPS, strict=True)]


def measure(blocks: int, arcs: float, seed: int = 1, done: Callable[[int], object] = lambda _: None
            ) -> Figures:
    """Run a program.

    Parameters
    ----------
    blocks : int
        Its blocks of motion, or a few more.
    arcs : float
        Share of its lines that are arcs.
    seed : int
        Of the random numbers.
    done : callable
        Called now and then with the number of blocks since the last time.
    """
    program, model = Program(seed, arcs), ProgramModel(SETTINGS)
    lines, total = program.lines(), Figures(0, 0, 0, 0, 0, 0, [0, 0, 0])
    while total.blocks < blocks:
        made, ends, wanted = [], [], []
        for line in islice(lines, min(CHUNK, blocks - total.blocks)):
            answer, found = model.line(line)
            if answer != "ok":
                raise RuntimeError(f"{line} is answered {answer}")
            made += found
            ends.append(len(made))
            wanted.append(exact_steps(program.position))
        steps = moved(made)
        places = np.concatenate([[total.end], total.end + np.cumsum(steps, axis=0)])
        off = np.abs(places[ends] - wanted).max(axis=1)
        total = Figures(
            total.lines + len(ends), total.blocks + len(made),
            total.arcs + sum(block.segment.arc for block in made if isinstance(block, Motion)),
            total.steps + int(np.abs(steps).sum()), total.off + int((off > 0).sum()),
            max(total.most, int(off.max())), places[-1].tolist())
        done(len(made))
    return total


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.end_positions", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--blocks", metavar="N", type=whole(1, 10**8), default=20_000,
                        help="blocks of motion (default: %(default)s)")
    parser.add_argument("--arcs", metavar="PERCENT", type=whole(0, 90), default=5,
                        help="lines of 100 that are arcs (default: %(default)s)")
    parser.add_argument("--seed", metavar="N", type=whole(0), default=1,
                        help="of the random numbers (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    check_output(args.json)
    with Progress(args.blocks, "blocks", "moving") as progress:
        found = measure(args.blocks, args.arcs / 100, args.seed, progress.advance)
    say(f"{found.blocks:,} blocks, {found.arcs:,} of them arcs, of {found.lines:,} lines; "
        f"{found.steps:,} steps between their ends")
    say("the end is ({}, {}, {}) steps".format(*found.end))
    say(f"lines after which an axis is off: {found.off}"
        + (f", by {found.most} steps at most" if found.off else ""))
    if args.json:
        write_atomically(args.json, (json.dumps(asdict(found), indent=1) + "\n").encode())
    return 1 if found.off else 0


if __name__ == "__main__":
    raise SystemExit(main())
