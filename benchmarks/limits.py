"""Speeds and accelerations at the pins of the G-code machine, against what it is set to."""

import json
import os
import random
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fresa.machines.gcode import GCode, GCodeSettings
from tb.boards import component
from tb.engines import CXXRTLEngine
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
from tools.gcode.simulation import Simulation, Steps
from tools.processes import pool

from .limit_programs import KINDS, Program, program
from .limit_windows import COARSE, QUANTITIES, SHARE, TIME, Found, measure

__all__ = ["MACHINE", "Result", "main", "of_steps", "run", "summary", "table"]

ERROR, ERROR_OF_SPEED, MOST_ERROR = 100 * SHARE, 100 * SHARE / 6, 100 * COARSE
"""Percent of a limit."""

ABOUT = f"""\
Sends random programs to the G-code machine at 50 MHz in simulation, clock by clock, and measures at
its STEP and DIR pins, in every block and between blocks:

  speed         of each axis, within its rate; along lines and arcs, within the feed
  acceleration  of each axis, within its limit, in lines and in arcs; in the plane of an arc that of
                both axes together, centripetal and tangential, within the lower of their limits
  junctions     the step of velocity between two blocks, within that of GRBL's junction deviation
                for $11 and the accelerations, at corners of lines and at the ends of arcs

Each program sets its own steps/mm, rates and accelerations, others for every axis. There are as
many of each kind: lines; arcs, full circles and helices in three planes; lines with corners of any
angle; short segments of a curve.

At an edge of STEP its axis passes from one step to the next, so its place is known: of a line but
for {TIME} clocks, of an arc to a quarter of a step besides. Three places give a mean of the
acceleration, two one of the speed. The window, of some ms and of tenths of one, is as long as makes
the error of the places {ERROR:g} % of the limit of an acceleration and {ERROR_OF_SPEED:g} % of that
of a speed. What is shorter is seen as the mean of its window, so the end of a ramp on an arc is
some percent below what it comes to. The speed at an end of a block is extrapolated from the steps
next to it; its error is what the limit of acceleration leaves open.
What has an error of more than {MOST_ERROR:g} % of its limit is left out. Of junctions that
is counted as not resolved, and so are those next to blocks of too few steps, and turns straight
back, of which the limit is 0.

Of each quantity it prints how many are measured, the median error, the highest ratio to the limit,
and the highest that is left when the error of each ratio is taken off it. Exit status 1 if the
latter is above 1, or nothing could be measured.
"""

EPILOG = """\
examples:
  python -m benchmarks.limits
  python -m benchmarks.limits corners --programs 1 --claim 90
      Claims limits that are 10 % lower than those that are set, and must fail.

see also: benchmarks.step_times for the instants of steps, benchmarks.arcs for circles.
"""

MACHINE = GCodeSettings(baud=1_000_000)
"""What is built: all else is set by `$n=`."""


class Result(NamedTuple):
    """A quantity of all programs.

    Attributes
    ----------
    measured, unresolved : int
        Windows or junctions that were measured; junctions that could not be.
    error : float
        Median of their errors, as a part of the limit.
    highest, least : float
        The highest ratio to a limit, and the highest less its error.
    """

    measured: int
    unresolved: int
    error: float
    highest: float
    least: float

    @property
    def right(self) -> bool:
        """Whether anything was measured, and no limit is exceeded."""
        return self.measured > 0 and self.least <= 1


def run(made: Program) -> Steps:
    """Run a program on the gateware; return its steps."""
    with CXXRTLEngine(component("gcode", GCode(settings=MACHINE))) as engine:
        machine = Simulation(engine, MACHINE)
        machine.do(machine.session.open())
        for lines in (made.settings, made.lines):
            machine.do(machine.session.stream(list(enumerate(lines))))
        machine.finish()
        if engine.get("fault"):
            raise RuntimeError("the machine shows a fault")
        return machine.steps()


def of_steps(made: Program, steps: Steps, claim: float = 1.0) -> Iterator[Found]:
    """Measure a program by the steps that it made."""
    rows = [np.flatnonzero(steps.change[:, axis]) for axis in range(3)]
    return measure(made, MACHINE.clock, [steps.clock[each] for each in rows],
                   [steps.change[each, axis].astype(np.int64)
                    for axis, each in enumerate(rows)], claim)


def measured(kind: str, seed: str, claim: float) -> list[Found]:
    """Make a random program, run it, and measure it."""
    made = program(kind, random.Random(seed))
    return list(of_steps(made, run(made), claim))


def summary(found: Iterable[Found], kinds: Iterable[str] = KINDS) -> dict[str, Result]:
    """Return what all windows of programs of some kinds come to, by quantity."""
    has = {"arcs" if kind == "arcs" else "lines" for kind in kinds}
    own: dict[str, list[Found]] = {
        quantity: [] for quantity in QUANTITIES
        if {"lines", "arcs"} == has or ("arcs" in has) == (" arc" in quantity)}
    for each in found:
        own.setdefault(each.quantity, []).append(each)
    results = {}
    for quantity, parts in own.items():
        ratio, least = (np.concatenate([np.zeros(0), *each]) for each in (
            [part.ratio for part in parts], [part.least for part in parts]))
        some = len(ratio) > 0
        results[quantity] = Result(
            len(ratio), sum(not len(part.ratio) for part in parts if "velocity" in quantity),
            *(round(float(each), 4) for each in (
                (np.median(ratio - least), ratio.max(), least.max()) if some else (0, 0, 0))))
    return results


def table(results: Mapping[str, Result]) -> Iterator[str]:
    """Yield the lines of the table."""
    yield (f"{'ratio to its limit':38} {'measured':>9} {'not':>5} {'error':>6} {'highest':>8} "
           f"{'less error':>10}")
    for quantity, result in results.items():
        note = "" if result.right else "  EXCEEDED" if result.measured else "  NOT MEASURED"
        yield (f"{quantity:38} {result.measured:9,} {result.unresolved:5,} {result.error:6.3f} "
               f"{result.highest:8.3f} {result.least:10.3f}{note}")


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.limits", description=ABOUT, epilog=EPILOG)
    parser.add_argument("kinds", metavar="KIND", nargs="*",
                        help=f"programs: {', '.join(KINDS)}; all of them")
    parser.add_argument("--programs", metavar="N", type=whole(1, 10**6), default=20,
                        help="programs, as many of each kind (default: %(default)s)")
    parser.add_argument("--claim", metavar="PERCENT", type=whole(1, 200), default=100,
                        help="of the limits that are set: what they are claimed to be "
                             "(default: %(default)s)")
    parser.add_argument("--jobs", metavar="N", type=whole(1, 1000), default=os.cpu_count(),
                        help="processes (default: %(default)s)")
    parser.add_argument("--seed", metavar="N", type=whole(0), default=1,
                        help="of the random numbers (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    kinds = [known(kind, KINDS, "kind") for kind in args.kinds] or list(KINDS)
    check_output(args.json)
    each = max(1, args.programs // len(kinds))
    chosen = [kind for _ in range(each) for kind in kinds]
    seeds = [f"{args.seed} {kind} {number // len(kinds)}" for number, kind in enumerate(chosen)]
    found: list[Found] = []
    with pool(args.jobs) as running, Progress(len(chosen), "programs", "moving") as progress:
        run_each = map if args.jobs == 1 else running.map
        for parts in run_each(measured, chosen, seeds, [args.claim / 100] * len(chosen)):
            found += parts
            progress.advance()
    results = summary(found, kinds)
    for line in table(results):
        say(line)
    good = all(result.right for result in results.values())
    if args.json:
        facts: dict[str, Any] = {
            "seed": args.seed, "programs": len(chosen), "claim": args.claim, "good": good,
            "limits": {quantity: result._asdict() for quantity, result in results.items()}}
        write_atomically(args.json, (json.dumps(facts, indent=1) + "\n").encode())
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
