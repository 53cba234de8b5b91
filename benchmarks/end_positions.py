"""Where the axes are after many blocks, against exact arithmetic on the text of the program."""

import json
import random
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from itertools import islice
from math import cos, floor, pi, sin
from pathlib import Path
from typing import Any

import numpy as np

from fresa.machines.gcode import GCode, GCodeSettings
from tb.boards import component
from tb.engines import CXXRTLEngine
from tb.models.gcode_blocks import Motion, ProgramModel
from tb.models.gcode_ends import moved
from tb.models.gcode_plan import PlanSettings
from tools.console import Parser, Progress, check_output, command, say, whole, write_atomically
from tools.gcode.simulation import Simulation
from tools.processes import pool

__all__ = ["Figures", "Pins", "Program", "exact_steps", "main", "measure", "measure_pins"]

ABOUT = """\
Runs a random program on the model of the G-code machine, which is that of the gateware to the bit:
from each line to its block, and from the block to the steps of the three axes. After each line the
axes must be at the step nearest to where the text of the program says, in rational numbers that are
never rounded, for all lines so far. Lines are absolute and relative, in mm and in inches; arcs and
helices in all planes are turned half turn by half turn. An axis has 80, one 78.74 and one 400
steps/mm, so that most ends are between two steps.

With --gateware such a program is also sent to the gateware in simulation, as fast as it answers,
with steps and lengths a tenth as large. Its steps are counted at its pins; every 500 lines it comes
to rest, and the axes must be where the text of all lines so far says.

Exit status 1 if an axis is ever a step off.
"""

EPILOG = """\
examples:
  python -m benchmarks.end_positions
  python -m benchmarks.end_positions --blocks 1000000 --json ends.json
      A million: some six minutes.
  python -m benchmarks.end_positions --blocks 1000000 --gateware 100000
      And a hundred thousand on the gateware, clock by clock: some ten minutes, on two cores.

see also: benchmarks.gcode for ends at the pins, benchmarks.arcs for what arcs do on their way.
"""

STEPS = (80_000, 78_740, 400_000)
"""Per metre."""

SETTINGS = PlanSettings(clock=50_000_000, speeds=(200_000_000, 200_000_000, 50_000_000),
                        accelerations=(1_000_000_000, 1_000_000_000, 200_000_000), steps=STEPS,
                        deviation=10_000)

SCALE = 0.1
FINE = GCodeSettings(
    clock=2_000_000, baud=125_000, deviation=Fraction(1, 10),
    steps_per_mm=tuple(Fraction(each, 100) for each in STEPS),
    max_rate=(Fraction(12_000), Fraction(12_000), Fraction(3000)),
    acceleration=(Fraction(17_000),) * 3)
"""The machine of the gateware: ten times the steps per mm, and the highest acceleration."""

REST = 500
"""Lines after which it comes to rest."""

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
    scale : float
        How large its motions are.

    Attributes
    ----------
    position : list of Fraction
        X, Y and Z in mm.
    """

    def __init__(self, seed: int, arcs: float, scale: float = 1) -> None:
        self.position = [Fraction(0)] * 3
        self._rng = random.Random(seed)
        self._arcs, self._scale = arcs, scale
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
            elif max(map(abs, self.position)) > REACH * self._scale:
                yield self._read("G90G0X0Y0Z0")
            elif draw < 0.02 + self._arcs:
                yield self._read(self._arc())
            else:
                size = self._scale * self._rng.choice([0.05, 0.1, 0.5, 5])
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
        radius = 0.05 * self._scale * 40**rng.random()
        begin = rng.uniform(0, 2 * pi)
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


def exact_steps(position: list[Fraction], steps: Sequence[int] = STEPS) -> list[int]:
    """Return the nearest steps, of two the higher, of machines with so many a metre."""
    return [floor(at * per_metre / 1000 + Fraction(1, 2))
            for at, per_metre in zip(position, steps, strict=True)]


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


@dataclass(frozen=True)
class Pins(Figures):
    """What a program has come to at the pins of the gateware, where the axes rest.

    Attributes
    ----------
    clocks : int
        How long it took.
    places : int
        Where it rested, which `off` counts.
    """

    clocks: int
    places: int


def measure_pins(blocks: int, arcs: float, seed: int = 1,
                 done: Callable[[int], object] = lambda _: None) -> Pins:
    """Run a program on the gateware; parameters are those of :func:`measure`."""
    program, store = Program(seed, arcs, SCALE), FINE.store
    lines, per_metre = program.lines(), [store[100 + axis] for axis in range(3)]
    total, before = Pins(0, 0, 0, 0, 0, 0, [0, 0, 0], 0, 0), list(program.position)
    with CXXRTLEngine(component("gcode", GCode(settings=FINE))) as engine:
        machine = Simulation(engine, FINE)
        machine.do(machine.session.open())
        begin = engine.clock
        while total.blocks < blocks:
            moves = curves = 0
            sent = []
            for text in islice(lines, min(REST, blocks - total.blocks)):
                sent.append((total.lines + len(sent), text))
                curve = bool(re.search("[IJK]", text))  # a full circle ends where it begins
                curves, moves = curves + curve, moves + (curve or program.position != before)
                before = list(program.position)
            machine.do(machine.session.stream(sent))
            machine.finish()
            end = machine.end()
            off = np.abs(end - exact_steps(program.position, per_metre))
            total = Pins(total.lines + len(sent), total.blocks + moves, total.arcs + curves,
                         machine.steps_made, total.off + bool(off.any()),
                         max(total.most, int(off.max())), end.tolist(),
                         engine.clock - begin, total.places + 1)
            done(moves)
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
    parser.add_argument("--gateware", metavar="N", type=whole(0, 10**8), default=0,
                        help="blocks of motion on the gateware (default: none)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    check_output(args.json)
    pins = None
    if args.gateware:  # on a core of its own
        with pool(1) as other, Progress(args.gateware, "blocks", "moving") as progress:
            model = other.submit(measure, args.blocks, args.arcs / 100, args.seed)
            pins = measure_pins(args.gateware, args.arcs / 100, args.seed, progress.advance)
            found = model.result()
    else:
        with Progress(args.blocks, "blocks", "moving") as progress:
            found = measure(args.blocks, args.arcs / 100, args.seed, progress.advance)
    say(f"{found.blocks:,} blocks, {found.arcs:,} of them arcs, of {found.lines:,} lines; "
        f"{found.steps:,} steps between their ends")
    say("the end is ({}, {}, {}) steps".format(*found.end))
    say(f"lines after which an axis is off: {found.off}"
        + (f", by {found.most} steps at most" if found.off else ""))
    facts: dict[str, Any] = {"seed": args.seed, "good": not found.off, "model": asdict(found)}
    if pins is not None:
        say(f"gateware: {pins.blocks:,} blocks, {pins.arcs:,} of them arcs, of {pins.lines:,} "
            f"lines, in {pins.clocks:,} clocks; {pins.steps:,} steps at its pins")
        say("the end is ({}, {}, {}) steps".format(*pins.end))
        say(f"places off, of {pins.places} where it rests: {pins.off}"
            + (f", by {pins.most} steps at most" if pins.off else ""))
        facts |= {"good": not found.off and not pins.off, "gateware": asdict(pins)}
    if args.json:
        write_atomically(args.json, (json.dumps(facts, indent=1) + "\n").encode())
    return 0 if facts["good"] else 1


if __name__ == "__main__":
    raise SystemExit(main())
