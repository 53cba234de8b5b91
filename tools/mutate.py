"""Make mutants of every component, which contracts and benches must kill."""

import argparse
import functools
import json
import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tb.contracts import GENERAL
from tb.contracts.proof import missing, versions
from tb.machine import Recorded
from tb.machines import machines
from tb.mutation import (
    Measure,
    MutationError,
    Trial,
    Verdict,
    begin,
    judge,
    measure,
    with_a_bench,
)
from tb.mutation.survivors import explained
from tb.registry import components

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
from .processes import pool

__all__ = ["Findings", "State", "load", "main", "pool_of", "run", "shares"]

ABOUT = """\
Changes every component in thousands of small ways: Yosys' mutate inverts a bit at a port of a cell,
or holds it, always or depending on another bit. Each mutant meets the bench and the contract of its
component, and one of them should kill it. A mutant that survives is equivalent, and that is proved,
or shows a gap.

  benches     every bench of python -m tb runs with all mutants of its component in parallel, and
              its own checks decide. A machine is also compared with its model, every output of
              every clock.
  contract    broken: random simulation, or a formula, finds inputs that break a property.
              unproved: none are found, but the induction of tools.prove fails.
  equivalent  induction over pairs of registers proves that no pin ever shows the mutant, for any
              inputs, and no upset of a state machine lets it show in 6 clocks. Not counted.

Components are those of the benches, with their parameters. The exit status is 1 if fewer are killed
of those that are counted than --least asks for.
"""

EPILOG = """\
examples:
  python -m tools.mutate
      5000 mutants of all components; half an hour on two cores. Interrupted, it goes on where it
      was; what has not changed since the last run is not run again.

  python -m tools.mutate coil divider --mutants 400
      Mutants of two components.

  python -m tools.mutate --mutants 300 --seed 7 --state other.json
      Some others, for a first look.

  python -m tools.mutate --json mutants.json
      Keep the figures, and every mutant with what became of it.

It needs z3 and Yosys: pip install -e '.[prove]'
"""

STATE = Path(__file__).parent.parent / "build" / "mutate" / "state.json"
#: Mutants that one process decides about at a time.
CHUNK = 12


@dataclass
class Findings:
    """What is known of the mutants of a component.

    Attributes
    ----------
    key : str
        Of all that it depends on.
    possible : int
        Mutants that there are.
    bench : str
        Name of the bench.
    mutants : list of str
        Those chosen, in words.
    commands : list of str
        The same, for Yosys.
    verdicts : dict of int to Verdict
        By the place in the list.
    gone : list of str
        Mutants that `tb.mutation.survivors` has a sentence about, and that there are not.
    """

    key: str
    possible: int
    bench: str = ""
    mutants: list[str] = field(default_factory=list)
    commands: list[str] = field(default_factory=list)
    verdicts: dict[int, Verdict] = field(default_factory=dict)
    gone: list[str] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Return whether all is known."""
        return bool(self.mutants) and len(self.verdicts) == len(self.mutants)

    def count(self) -> Counter:
        """Count what became of them."""
        counts: Counter = Counter()
        for verdict in self.verdicts.values():
            counts["mutants"] += 1
            counts["equivalent"] += verdict.equivalent
            counts["broken"] += verdict.contract == "broken"
            counts["unproved"] += verdict.contract == "unproved"
            counts["contract"] += bool(verdict.contract)
            counts["bench"] += verdict.bench is not None
            counts["killed"] += verdict.killed
            counts["survive"] += not verdict.killed and not verdict.equivalent
        return counts

    def outdated(self, name: str) -> list[str]:
        """List mutants that are explained as survivors of a component, and are none."""
        return [*self.gone, *(mutant for number, mutant in enumerate(self.mutants)
                              if (name, mutant) in explained()
                              and number in self.verdicts and number not in self.survivors)]

    @property
    def survivors(self) -> list[int]:
        """Those that nothing found and that may be mutants."""
        return [number for number, verdict in sorted(self.verdicts.items())
                if not verdict.killed and not verdict.equivalent]


@dataclass
class State:
    """A run and how far it is.

    Attributes
    ----------
    seed : int
        Of all chance.
    findings : dict of str to Findings
        By component.
    """

    seed: int
    findings: dict[str, Findings] = field(default_factory=dict)

    def save(self, path: Path) -> None:
        """Write it, whole."""
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, (json.dumps(asdict(self)) + "\n").encode())


def load(path: Path, seed: int) -> State:
    """Read what is known from a run before; nothing, if it was none with this seed.

    Raises
    ------
    UserError
        If the file is none of this command.
    """
    if not path.exists():
        return State(seed)
    try:
        data = json.loads(path.read_bytes())
        findings = {
            name: Findings(**{**found, "verdicts": {
                int(number): Verdict(**verdict) for number, verdict in found["verdicts"].items()}})
            for name, found in data["findings"].items()}
        return State(seed, findings if data["seed"] == seed else {})
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise UserError(f"{path} is not the state of mutants: give another --state, "
                        "or delete it") from error


def shares(possible: dict[str, int], mutants: int) -> dict[str, int]:
    """Share out mutants to components by the square root of their sizes.

    What is large is so because others are in it, which have mutants of their own.
    """
    given = dict.fromkeys(possible, 0)
    while left := min(mutants, sum(possible.values())) - sum(given.values()):
        weights = {name: size ** 0.5 for name, size in possible.items() if given[name] < size}
        for name, weight in sorted(weights.items(), key=lambda item: -item[1]):
            more = max(1, int(left * weight / sum(weights.values())))
            rest = mutants - sum(given.values())
            given[name] += min(more, possible[name] - given[name], rest)
    return given


def run(state: State, path: Path, names: Sequence[str], mutants: int, jobs: int) -> None:
    """Find out what becomes of so many mutants of some components; save it again and again."""
    with pool(jobs) as workers:
        with Progress(len(names), "components", "counting mutants") as progress:
            measures = _all(workers, {name: (measure, name) for name in names}, progress.advance)
        given = shares({name: measures[name].mutants for name in names}, mutants)
        given = {name: _keep_or_begin(state, name, measures[name], given[name])
                 for name in names}
        left = [name for name in names if not state.findings[name].complete]
        with Progress(sum(given.values()), "mutants", "mutants") as progress:
            progress.advance(sum(len(state.findings[name].verdicts) for name in names))
            _decide(workers, jobs, state, path, {name: given[name] for name in left},
                    progress.advance)


def _keep_or_begin(state: State, name: str, measured: Measure, count: int) -> int:
    """Keep what is known of about so many mutants; say how many it is of.

    Shares shift by a few when another component gets larger.
    """
    found = state.findings.get(name)
    known = len(found.mutants) if found else 0
    if found is None or found.key != measured.key or (
            known and abs(known - count) * 20 > count):
        state.findings[name] = Findings(measured.key, measured.mutants)
        known = 0
    state.findings[name].gone = list(measured.gone)
    return known or count


def _decide(workers: ProcessPoolExecutor, jobs: int, state: State, path: Path,
            given: dict[str, int], advance: Callable[[int], object]) -> None:
    # The largest first, so that in the end no core waits for another.
    waiting: list[Callable[[], tuple[str, Future]]] = []

    def start(name: str) -> tuple[str, Future]:
        return name, workers.submit(begin, name, given[name], state.seed)

    def decide(trial: Trial, numbers: list[int]) -> tuple[str, Future]:
        return trial.name, workers.submit(judge, trial, numbers)

    for name in sorted(given, key=lambda name: given[name]):
        waiting.append(functools.partial(start, name))
    running: dict[Future, str] = {}
    failed: list[str] = []
    while waiting or running:
        while waiting and len(running) < jobs:
            name, future = waiting.pop()()
            running[future] = name
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            name = running.pop(future)
            try:
                result = future.result()
            except MutationError as error:  # the others go on, and are kept
                failed.append(f"{name}: {error}")
                continue
            found = state.findings[name]
            before = len(found.verdicts)
            if isinstance(result, Trial):
                found.bench = result.bench
                found.mutants = list(map(str, result.mutants))
                found.commands = [mutant.command for mutant in result.mutants]
                found.verdicts |= result.verdicts
                numbers = [number for number in result.open if number not in found.verdicts]
                for first in range(0, len(numbers), CHUNK):
                    waiting.append(functools.partial(decide, result,
                                                     numbers[first:first + CHUNK]))
            else:
                found.verdicts |= result
            advance(len(found.verdicts) - before)
            state.save(path)
    if failed:
        raise UserError(f"no mutants of {'; of '.join(failed)}")


def _all(workers: ProcessPoolExecutor, work: dict[str, tuple], advance: Callable[[], object]
         ) -> dict:
    tasks = {name: workers.submit(*call) for name, call in work.items()}
    for task in tasks.values():
        task.add_done_callback(lambda _: advance())
    try:
        return {name: task.result() for name, task in tasks.items()}
    except MutationError as error:
        raise UserError(str(error)) from error


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.mutate", description=ABOUT, epilog=EPILOG, machines=True)
    parser.add_argument("components", metavar="COMPONENT", nargs="*",
                        help="what to change; all that have a bench")
    parser.add_argument("--machine", metavar="NAME",
                        help="the components that this machine alone has, and others that it names")
    parser.add_argument("--general", action="store_true",
                        help="the components that no machine has alone, or names")
    parser.add_argument("--mutants", metavar="N", type=whole(1), default=5000,
                        help="how many in all; large components get more (default: %(default)s)")
    parser.add_argument("--seed", metavar="N", type=whole(0), default=1,
                        help="of the choice, and of all chance (default: %(default)s)")
    parser.add_argument("--least", metavar="PERCENT", type=_percent, default=Recorded.mutants_least,
                        help="killed of those that are not equivalent (default: 99)")
    parser.add_argument("--state", metavar="FILE", type=Path, default=STATE,
                        help="keep what is known there (default: build/mutate/state.json of the "
                             "checkout)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    parser.add_argument("--jobs", metavar="N", type=whole(1, 256), default=os.cpu_count() or 1,
                        help="processes (default: all cores)")
    args = parser.parse_args(argv)
    names = [known(name, components(), "component") for name in dict.fromkeys(args.components)]
    if sum(map(bool, (names, args.machine, args.general))) > 1:
        raise UserError("name components, or a machine, or ask for the general ones")
    check_output(args.json)
    if lacking := missing():
        raise UserError(lacking)
    began = time.monotonic()
    pool = names or pool_of(args.machine, general=args.general)
    names = [name for name in pool if name in with_a_bench()]
    if not names:
        raise UserError(f"{' '.join(pool) or args.machine} has no component with a contract and a "
                        "bench")
    state = load(args.state, args.seed)
    run(state, args.state, names, args.mutants, args.jobs)
    return _report(args, state, names, [name for name in pool if name not in names],
                   time.monotonic() - began)


def _report(args: argparse.Namespace, state: State, names: Sequence[str], without: Sequence[str],
            seconds: float) -> int:
    every: Counter = Counter()
    rows, survivors = {}, []
    say(f"{'component':14} {'mutants':>8} {'equivalent':>10} {'contract':>9} {'unproved':>9} "
        f"{'benches':>8} {'killed':>7} {'survive':>8} {'score':>8}")
    for name in names:
        found = state.findings[name]
        counts = found.count()
        every += counts
        rows[name] = {"possible": found.possible, "bench": found.bench, **_figures(counts)}
        say(_line(name, counts))
        survivors += [{"component": name, "mutant": found.mutants[number],
                       "command": found.commands[number],
                       "explained": explained().get((name, found.mutants[number]), "")}
                      for number in found.survivors]
    say(_line("all", every))
    for survivor in survivors:
        say(f"survives   {survivor['component']}: {survivor['mutant']}")
        say(f"           {survivor['explained'] or 'not explained yet'}")
    outdated = {name: gone for name in names if (gone := state.findings[name].outdated(name))}
    for name, gone in outdated.items():
        for mutant in gone:
            say(f"explained, but killed or gone   {name}: {mutant}")
    score = _figures(every)["score"]
    good = score >= args.least
    say(f"{'good' if good else 'BAD':10} {score:.2f} % of {every['mutants'] - every['equivalent']}"
        f" killed, {args.least:g} % requested; seed {args.seed}, {seconds:.0f} s")
    if args.json is not None:
        facts = {
            "seed": args.seed, "seconds": round(seconds, 1), "least": args.least,
            "versions": versions(),
            "good": good, "all": _figures(every), "components": rows, "survivors": survivors,
            "outdated": outdated, "without": without,
            "mutants": {name: [{"mutant": mutant, **asdict(found.verdicts[number])}
                               for number, mutant in enumerate(found.mutants)]
                        for name in names if (found := state.findings[name])},
        }
        write_atomically(args.json, (json.dumps(facts, indent=1) + "\n").encode())
        say(f"wrote      {args.json}")
    return 0 if good else 1


def pool_of(name: str | None, *, general: bool = False) -> list[str]:
    """Name the components that are meant: general ones, or those of a machine, or all."""
    if general:
        others = {each for machine in machines().values() for each in machine.recorded.mutated}
        return [each for each in components() if each in GENERAL and each not in others]
    if name is None:
        return list(components())
    machine = machines()[known(name, machines(), "machine")]
    own = list(machine.contracts() if machine.contracts else ())
    return [*(each for each in own if each != name or not machine.recorded.unmutated),
            *machine.recorded.mutated]


def _figures(counts: Counter) -> dict:
    left = counts["mutants"] - counts["equivalent"]
    return {**{name: counts[name] for name in (
        "mutants", "equivalent", "contract", "broken", "unproved", "bench", "killed", "survive")},
        "score": round(100 * counts["killed"] / left, 3) if left else 100.0}


def _line(name: str, counts: Counter) -> str:
    c = _figures(counts)
    return (f"{name:14} {c['mutants']:>8} {c['equivalent']:>10} {c['contract']:>9} "
            f"{c['unproved']:>9} {c['bench']:>8} {c['killed']:>7} {c['survive']:>8} "
            f"{c['score']:>6.2f} %")


def _percent(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1
    if not 0 <= value <= 100:
        raise argparse.ArgumentTypeError(f"must be from 0 to 100, not {text!r}")
    return value


if __name__ == "__main__":
    raise SystemExit(main())
