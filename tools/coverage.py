"""Measure coverage: FSM states and transitions by proof, lines and toggles by simulation."""

import argparse
import json
import os
import tempfile
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from tb.contracts.proof import ProofError, missing
from tb.coverage import Reached, cover_lines, cover_states, with_state_machine
from tb.engines import EngineError
from tb.engines.coverage import CoverageEngine, Point
from tb.machine import Coverage
from tb.machines import machines

from .console import (
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    say,
    whole,
    write_atomically,
)

__all__ = ["main"]

ABOUT = """\
Two measures of what is looked at:

  states   Of every state machine, whether inputs lead to each state and through each transition
           that is written in it, from power-up; found by a solver. The state
           for upset registers, and the transitions to it, are sought from any code in the register.
  lines    Of a machine, which lines, branches and bits the stimulus of tools.cosim covers, as
           Verilator counts them. A bit is covered when it changes. The machine is the mill, unless
           --machine names another.

Bits that nothing can change are counted as well: what a parameter fixes, or a component has and
its machine does not use. Of those, machines on a serial line have more. Of a machine whose
declaration says so, only bits of signals with a name in the gateware are counted.
"""

EPILOG = """\
examples:
  python -m tools.coverage
      Both; many minutes, as a solver looks for each transition.

  python -m tools.coverage states --verbose
      Name every state and transition, and the clock in which it is first reached.

  python -m tools.coverage lines --cycles 1000000
      Run longer; what was never covered is listed.

  python -m tools.coverage lines --machine single
      Of a machine on a serial line, on which a byte takes many clocks: so it runs longer.

exit status: 0 if every state and transition is reached and --least percent of the lines and of
the bits are covered, 1 if not, 2 if the command cannot be carried out.
"""


KINDS = {"lines and branches": ("line", "branch"), "bits": ("toggle",)}
"""Of points, under the names that people read."""


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    goals = {name: machine.coverage for name, machine in machines().items() if machine.coverage}
    parser = Parser(prog="python -m tools.coverage", machines=True, description=ABOUT,
                    epilog=EPILOG)
    parser.add_argument("measures", metavar="MEASURE", nargs="*", help="states or lines; both")
    parser.add_argument("--machine", metavar="NAME", choices=list(goals),
                        default=next(iter(goals)),
                        help=f"whose lines: {', '.join(goals)} (default: %(default)s)")
    parser.add_argument("--cycles", metavar="N", type=whole(1),
                        help=f"clocks to run (default: {_goals(goals, '{0.cycles}')})")
    parser.add_argument("--seed", metavar="S", type=whole(0), default=1,
                        help="seed of the stimulus (default: %(default)s)")
    parser.add_argument("--least", metavar="P", type=_percent,
                        help="percent of lines and branches, and of bits, to cover (default: "
                             f"{_goals(goals, '{0.lines} and {0.bits}')})")
    parser.add_argument("--verbose", action="store_true",
                        help="name also the states and transitions that are reached")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    for measure in args.measures:
        if measure not in ("states", "lines"):
            raise UserError(f"there is no measure {measure!r}: choose states or lines")
    check_output(args.json)
    measures = args.measures or ["states", "lines"]
    lacking = [reason for measure, reason in (("states", missing()),
                                              ("lines", CoverageEngine.missing()))
               if measure in measures and reason]
    if lacking:
        raise UserError("; ".join(lacking))

    goal, facts, good = goals[args.machine], {}, True
    if "states" in measures:
        states = _states()
        good &= _tell_states(states, verbose=args.verbose)
        facts["states"] = [asdict(point) for point in states]
    if "lines" in measures:
        cycles = args.cycles or goal.cycles
        with Progress(cycles, "clocks", "running") as progress:
            try:
                points = cover_lines(args.machine, args.seed, cycles, progress.advance)
            except EngineError as error:
                raise UserError(str(error)) from error
        found = _tell_lines(points)
        least = (goal.lines, goal.bits) if args.least is None else (args.least, args.least)
        for what, percent in zip(KINDS, least, strict=True):
            found[what]["least"] = percent
            if found[what]["percent"] < percent:
                say(f"NOT {percent:g} % of {what}")
                good = False
        facts["lines"] = {"machine": args.machine, "engine": CoverageEngine.version(),
                          "seed": args.seed, "clocks": cycles, **found}
    if args.json is not None:
        write_atomically(args.json, (json.dumps(facts, indent=2) + "\n").encode())
        say(f"wrote {args.json}")
    return 0 if good else 1


def _states() -> list[Reached]:
    lock = threading.Lock()
    contracts = with_state_machine()

    def cover(name: str) -> list[Reached]:
        with tempfile.TemporaryDirectory() as folder:
            try:
                return cover_states(name, contracts[name], Path(folder), lock)
            except ProofError as error:
                raise UserError(f"the prover gave up on {name}: {error}") from error

    found = []
    with (Progress(len(contracts), "state machines", "covering") as progress,
          ThreadPoolExecutor(os.cpu_count() or 1) as pool):
        for reached in pool.map(cover, contracts):
            found += reached
            progress.advance()
    return found


def _tell_states(points: Sequence[Reached], *, verbose: bool) -> bool:
    for name in dict.fromkeys(point.component for point in points):
        own = [point for point in points if point.component == name]
        for kind in ("state", "transition"):
            all_ = [point for point in own if point.kind == kind]
            say(f"{name:14} {sum(p.clock is not None for p in all_):3} of {len(all_):3} {kind}s")
        for point in own:
            if point.clock is None:
                say(f"  NOT REACHED: {point.kind} {point.name}")
            elif verbose:
                upset = ", from an upset register" if point.upset else ""
                say(f"  clock {point.clock:3}: {point.kind} {point.name}{upset}")
    return all(point.clock is not None for point in points)


def _tell_lines(points: Sequence[Point]) -> dict:
    facts = {}
    for what, kinds in KINDS.items():
        own = [point for point in points if point.kind in kinds]
        seen = sum(point.count > 0 for point in own)
        facts[what] = {"all": len(own), "seen": seen, "percent": round(100 * seen / len(own), 2)}
        say(f"{what:20} {seen:5} of {len(own):5}  {facts[what]['percent']:.2f} %")
    for point in points:
        if not point.count:
            say(f"  never: {point.kind} {point.what}, in {point.module}")
    return {**facts, "never": [asdict(point) for point in points if not point.count]}


def _goals(goals: Mapping[str, Coverage], what: str) -> str:
    return "; ".join(f"{what.format(goal)} of {name}" for name, goal in goals.items())


def _percent(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 100:
        raise argparse.ArgumentTypeError(f"must be 0 to 100, not {text!r}")
    return value


if __name__ == "__main__":
    raise SystemExit(main())
