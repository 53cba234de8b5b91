"""Prove the properties of every component, for every input and unbounded time."""

import hashlib
import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Generic, TypeVar

from tb.contracts.contract import Case
from tb.contracts.proof import Proof, ProofError, missing, prove, versions
from tb.mutation.kills import Kill, kills
from tb.mutation.netlist import MutationError
from tb.registry import components

from . import fingerprints
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

__all__ = ["Known", "main", "run_mutants", "run_proofs"]

T = TypeVar("T", Proof, Kill)

TRACES = Path(__file__).parent.parent / "build" / "prove"

ABOUT = """\
Proves contracts, those in tb/contracts and those of machines: the properties of each component, for
every sequence of inputs, for unbounded time, with reset in any clock. A proof has a base case, from
power-up, and an induction over k clocks from any state that keeps all properties. Beside each proof
stands a cover, which shows that the premise can come about: a property whose premise never does is
vacuous.

Every component is proved with small parameters, which have the covers, and most with those of the
board, too; docs/evidence.md names the others.

The exit status is 1 if a property is not proved. With --mutants the netlist of each component is
changed in small ways, each property has to be broken by one of these mutants, and the status is 1
if one is not that is no lemma (which only an induction needs).
"""

EPILOG = """\
examples:
  python -m tools.prove
      Prove everything; some minutes on two cores.

  python -m tools.prove coil divider
      Prove two components.

  python -m tools.prove --list controller
      List the properties of the controller, without proving them.

  python -m tools.prove --mutants coil
      Find for each property of the coil driver a mutant that breaks it, and name it.

  python -m tools.prove --state proved.json
      Prove everything, and keep it there: the next time, only what is of other gateware or
      properties is proved.

  python -m tools.prove --json proofs.json
      Keep what was proved, with which parameters, k, depth of the base case, covers and seconds,
      the totals, and the versions of the provers.

verdicts:
  proved        base case and induction hold
  FAILED        broken in the clock named, from power-up; the waveform is kept
  not proved    induction finds a way to break it; the waveform starts from a state that may never
                come about: what is missing is a property about that
  vacuous       no input leads to its premise in the clocks looked at

It needs z3 and Yosys: pip install -e '.[prove]'
"""


class Known(Generic[T]):
    """What an earlier run found, as far as it holds: of the same gateware, properties and provers.

    Parameters
    ----------
    path : Path
        File that keeps it. One that is missing is begun.
    kind : type
        Of what is found.
    names : iterable of str
        Components.
    jobs : int, optional
        Processes; as many as there are cores by default.

    Raises
    ------
    UserError
        If the file is of something else.
    """

    def __init__(self, path: Path, kind: type[T], names: Iterable[str],
                 jobs: int | None = None) -> None:
        self._path, self._kind = path, kind
        names = list(names)
        taken = fingerprints.take((f"contract {name}" for name in names), jobs)
        self._keys = {name: hashlib.sha256(json.dumps([
            taken[f"contract {name}"], components()[name].depth, versions(),
            [[each.name, each.description] for each in components()[name].properties().values()],
        ]).encode()).hexdigest()[:16] for name in names}
        try:
            self._found = json.loads(path.read_bytes()) if path.exists() else {}
            for found in self._found.values():
                self._results(found)
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise UserError(f"{path} does not hold what was proved: give another --state, or "
                            "delete it") from error

    def get(self, name: str, part: str) -> list[T] | None:
        """Return what was found of a part of a component, if it still holds."""
        found = self._found.get(f"{name} {part}")
        return self._results(found) if found and found["key"] == self._keys[name] else None

    def keep(self, name: str, part: str, results: list[T]) -> None:
        """Keep what was found."""
        self._found[f"{name} {part}"] = {"key": self._keys[name],
                                         "results": [asdict(each) for each in results]}
        write_atomically(self._path, (json.dumps(self._found, indent=1) + "\n").encode())

    def _results(self, found: Mapping) -> list[T]:
        return [self._kind(**each) for each in found["results"]]


def run_proofs(names: Iterable[str], traces: Path = TRACES, jobs: int | None = None,
               done: Callable[[list[Proof]], None] = lambda proofs: None,
               known: Known[Proof] | None = None, *, small: bool = False) -> list[Proof]:
    """Prove components, one case a core at a time.

    Parameters
    ----------
    names : iterable of str
        Components.
    traces : path
        Where to leave waveforms of what fails.
    jobs : int, optional
        Proofs at a time; as many as there are cores by default.
    done : callable
        Called with the proofs of each case as it is finished.
    known : Known, optional
        What need not be proved again. What fails is not kept.
    small : bool
        Leave out the parameters of the board.
    """
    lock = threading.Lock()

    def prove_case(name: str, case: Case) -> list[Proof]:
        with tempfile.TemporaryDirectory() as folder, _in_words(name):
            return prove(name, components()[name], case, Path(folder), traces, lock)

    with ThreadPoolExecutor(jobs or os.cpu_count() or 1) as workers:
        proofs = _in_order(
            workers, {(name, str(case)): (prove_case, name, case) for name in names
                      for case in _cases(name, small)}, done, known,
            lambda proof: proof.verdict in ("proved", "vacuous"))
    # One case that reaches a premise is enough.
    reached = {(proof.component, proof.name) for proof in proofs if proof.reached is not None}
    for proof in proofs:
        if proof.verdict == "vacuous" and (proof.component, proof.name) in reached:
            proof.verdict = "proved"
    return proofs


def _cases(name: str, small: bool) -> list[Case]:
    return [case for case in components()[name].cases if not (small and case.real)]


def run_mutants(names: Iterable[str], jobs: int | None = None,
                done: Callable[[list[Kill]], None] = lambda found: None,
                known: Known[Kill] | None = None) -> list[Kill]:
    """Find mutants that break the properties of some components; see :func:`run_proofs`."""
    order = list(names)
    with pool(jobs or os.cpu_count() or 1) as workers:
        # Machines come last and take longest: they begin first.
        found = _in_order(workers, {(name, "mutants"): (_kills, name) for name in reversed(order)},
                          done, known, lambda kill: bool(kill.mutant) or kill.lemma)
    return sorted(found, key=lambda kill: order.index(kill.component))


def _kills(name: str) -> list[Kill]:
    with _in_words(name):
        return kills(name, components()[name])


@contextmanager
def _in_words(name: str) -> Iterator[None]:
    """Say of which component a prover gave up."""
    try:
        yield
    except (ProofError, MutationError) as error:
        raise UserError(f"the prover gave up on {name}: {error}") from error


def _in_order(workers: Executor, work: Mapping[tuple[str, str], tuple],
              done: Callable[[list], None], known: Known | None,
              good: Callable[..., bool]) -> list:
    """Do what is not known yet; give the results in the order of the work."""
    found = {part: known.get(part[0], part[1]) if known else None for part in work}
    tasks = {}
    for part, call in work.items():
        if (results := found[part]) is None:
            tasks[workers.submit(*call)] = part
        else:
            done(results)
    try:
        for task in as_completed(tasks):
            part, results = tasks[task], task.result()
            found[part] = results
            if known and all(map(good, results)):
                known.keep(part[0], part[1], results)
            done(results)
    except BaseException:
        workers.shutdown(cancel_futures=True)
        raise
    return [result for results in found.values() for result in results or ()]


@contextmanager
def _progress(total: int, label: str) -> Iterator[Callable[[list], None]]:
    with Progress(total, "cases" if label == "proving" else "components", label) as progress:
        yield lambda results: progress.advance()


def kill_line(kill: Kill) -> str:
    """Return which mutant breaks a property, in a line."""
    found = (f"broken in clock {kill.clock} by {kill.mutant}" if kill.mutant
             else "lemma" if kill.lemma else "NOT BROKEN")
    return f"{kill.component:13} {kill.name:30} {kill.case:26} {found}"


def line(proof: Proof) -> str:
    """Return what became of a property, in a line."""
    k = "-" if proof.k is None else proof.k
    text = (f"{proof.component:13} {proof.name:30} {proof.case:26} k={k} "
            f"base {proof.base:5.1f} s  induction {proof.induction:5.1f} s  {proof.verdict}")
    if proof.clock is not None:
        text += f" in clock {proof.clock}"
    return f"{text}, see {proof.trace}" if proof.trace else text


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.prove", description=ABOUT, epilog=EPILOG, machines=True)
    parser.add_argument("components", metavar="COMPONENT", nargs="*", help="what to prove; all")
    parser.add_argument("--mutants", "--controls", action="store_true",
                        help="find a mutant that breaks each property, instead of proving")
    parser.add_argument("--list", action="store_true", help="list the properties, and stop")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the results there")
    parser.add_argument("--traces", metavar="FOLDER", type=Path, default=TRACES,
                        help="leave waveforms of failures there (default: build/prove of the "
                             "checkout)")
    parser.add_argument("--state", metavar="FILE", type=Path,
                        help="keep what is found there, and do not look again for what is known; "
                             "proofs and mutants need a file each")
    parser.add_argument("--small", action="store_true",
                        help="leave out the parameters of the board, which take most of the time")
    parser.add_argument("--jobs", metavar="N", type=whole(1, 256),
                        help="at a time (default: all cores)")
    args = parser.parse_args(argv)

    names = [known(name, components(), "component")
             for name in dict.fromkeys(args.components)] or list(components())
    if args.list:
        for name in names:
            for each in components()[name].properties().values():
                say(f"{name:13} {each.name:30} {each.description}")
        return 0
    if lacking := missing():
        raise UserError(lacking)
    check_output(args.json)
    check_output(args.state)

    began = time.monotonic()
    if args.mutants:
        with _progress(len(names), "breaking") as done:
            found = run_mutants(names, args.jobs, done,
                                Known(args.state, Kill, names, args.jobs)
                                if args.state else None)
        return _report(found, "mutants", map(kill_line, found), args.json,
                       [bool(each.mutant) or each.lemma for each in found],
                       "properties are broken by a mutant, or are lemmas",
                       time.monotonic() - began)

    total = sum(len(_cases(name, args.small)) for name in names)
    with _progress(total, "proving") as done:
        proofs = run_proofs(names, args.traces, args.jobs, done,
                            Known(args.state, Proof, names, args.jobs)
                            if args.state else None, small=args.small)
    properties = {(proof.component, proof.name) for proof in proofs}
    return _report(proofs, "proofs", map(line, proofs), args.json,
                   [p.verdict == "proved" for p in proofs],
                   f"proofs of {len(properties)} properties hold for ever",
                   time.monotonic() - began)


def _report(results: list, kind: str, lines: Iterable[str], path: Path | None, good: list[bool],
            what: str, seconds: float) -> int:
    for text in lines:
        say(text)
    say(f"{sum(good)} of {len(good)} {what}")
    if path is not None:
        facts = {
            "versions": versions(),
            "seconds": round(seconds, 1),
            "components": len({result.component for result in results}),
            "properties": len({(result.component, result.name) for result in results}),
            "total": len(good),
            "good": sum(good),
            kind: [asdict(result) for result in results],
        }
        write_atomically(path, (json.dumps(facts, indent=2) + "\n").encode())
        say(f"wrote {path}")
    return 0 if all(good) else 1


if __name__ == "__main__":
    raise SystemExit(main())
