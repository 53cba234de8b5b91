"""Compare the gateware with its VHDL reference, clock by clock and by proof."""

import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tb.contracts.proof import Proof, ProofError, missing, prove, versions
from tb.cosim import Outcome, lockstep
from tb.engines import EngineError, choose, why_slow
from tb.engines.ghdl import GHDLEngine
from tb.registry import duts
from tb.runners import close_all, make_runners, stimuli
from tb.vhdl import REFERENCES
from tb.vhdl.miter import MITERS, Control, check

from .console import (
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    known,
    say,
    warn,
    whole,
    write_atomically,
)

__all__ = ["Comparison", "main", "run"]

TRACES = Path(__file__).parent.parent / "build" / "vhdl"

ABOUT = """\
Compares components of the mill, and the whole mill, with the entities in tb/vhdl, which were
written in VHDL from the thesis. Each is compared in three ways:

  in step   equal stimulus for the gateware and for GHDL; every output of every clock
  proved    GHDL's Verilog and the gateware in one circuit with common inputs: all outputs are
            equal in every clock from power-up, for every input, unbounded, with reset in any
            clock; with small parameters, and with those of the board
  control   a mutant of the gateware, for which the solver must find a difference

The exit status is 1 if two differ, something is not proved, or a mutant is not found.
"""

EPILOG = """\
examples:
  python -m tools.vhdl
      Compare all of them; about a minute on two cores.

  python -m tools.vhdl sequencer --cycles 1000000 --seed 7
      One component, with a longer stimulus and another one.

  python -m tools.vhdl --list
      List the entities, their components and files.

  python -m tools.vhdl --json vhdl.json
      Write all figures: clocks, seconds, properties with their k, versions.

A difference is shown, shrunk and drawn by
  python -m tools.cosim --machine COMPONENT --engines cxxrtl,ghdl

It needs GHDL (Debian's package ghdl), and z3 and Yosys: pip install -e '.[prove]'
"""


@dataclass
class Comparison:
    """Result of comparing a component with its VHDL.

    Attributes
    ----------
    name, entity : str
        Names of both.
    engine : str
        Engine of the gateware.
    outcome : Outcome
        Result of the run in step.
    proofs : list of Proof
        Of every case.
    controls : list of Control
        Results of the mutants.
    seconds : dict of str to float
        Time that the run in step, the proofs and the control took.
    """

    name: str
    entity: str
    engine: str
    outcome: Outcome | None = None
    proofs: list[Proof] = field(default_factory=list)
    controls: list[Control] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def differs(self) -> str | None:
        """First difference in step."""
        return str(self.outcome.finding) if self.outcome and self.outcome.finding else None

    @property
    def unproved(self) -> list[Proof]:
        """Proofs that failed."""
        return [proof for proof in self.proofs if proof.verdict != "proved"]

    @property
    def good(self) -> bool:
        """Whether all comparisons agree and every mutant was found."""
        return (self.outcome is not None and not self.differs and bool(self.proofs)
                and not self.unproved and bool(self.controls)
                and all(control.clock is not None for control in self.controls))


def run(names: Iterable[str], *, cycles: int, seed: int, jobs: int | None = None,
        traces: Path = TRACES, advance: Callable[[], object] = lambda: None) -> list[Comparison]:
    """Compare components with their VHDL.

    Parameters
    ----------
    names : iterable of str
        Components, as in `REFERENCES`.
    cycles : int
        Clocks in step.
    seed : int
        Of the stimulus.
    jobs : int, optional
        Tasks that run in parallel; None for the number of cores.
    traces : path
        Folder for waveforms of failed proofs.
    advance : callable
        Called after each task: see :func:`steps`.
    """
    engine = choose().name
    made = {name: Comparison(name, REFERENCES[name].entity, engine) for name in names}
    lock = threading.Lock()

    def in_step(one: Comparison) -> tuple[str, Any]:
        machine = duts()[one.name]
        with lock:
            outputs = list(machine.shared.outputs)
        runners = make_runners(machine, [engine, "ghdl"])
        try:
            return "in_step", lockstep(runners, stimuli(machine, seed, cycles), outputs)
        finally:
            close_all(runners)

    def prove_case(one: Comparison, number: int) -> tuple[str, Any]:
        miter = MITERS[one.name]
        miter.module(miter.cases[number])
        with tempfile.TemporaryDirectory() as folder:
            return "proofs", prove(one.name, miter, miter.cases[number], Path(folder), traces, lock)

    def plant(one: Comparison) -> tuple[str, Any]:
        miter = MITERS[one.name]
        miter.module(miter.cases[0])
        with tempfile.TemporaryDirectory() as folder:
            return "controls", [check(one.name, miter, Path(folder), lock)]

    def timed(one: Comparison, do: Callable, *arguments: object) -> None:
        began = time.monotonic()
        try:
            what, result = do(one, *arguments)
        except ProofError as error:
            raise UserError(f"the prover gave up on {one.name}: {error}") from error
        seconds = time.monotonic() - began
        with lock:
            one.seconds[what] = one.seconds.get(what, 0.0) + seconds
            if what == "in_step":
                one.outcome = result
            else:
                getattr(one, what).extend(result)

    with ThreadPoolExecutor(jobs or os.cpu_count() or 1) as pool:
        tasks: list[Future] = []
        for one in reversed(made.values()):  # the longest come last in the table
            tasks += [pool.submit(timed, one, prove_case, number)
                      for number in range(len(MITERS[one.name].cases))]
            tasks += [pool.submit(timed, one, in_step), pool.submit(timed, one, plant)]
        try:
            for task in as_completed(tasks):
                task.result()
                advance()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    for one in made.values():
        # One case that reaches a premise is enough.
        reached = {proof.name for proof in one.proofs if proof.reached is not None}
        for proof in one.proofs:
            if proof.verdict == "vacuous" and proof.name in reached:
                proof.verdict = "proved"
    return list(made.values())


def steps(names: Iterable[str]) -> int:
    """Return the number of tasks for some components."""
    return sum(len(MITERS[name].cases) + 2 for name in names)


def line(one: Comparison) -> str:
    """Format the result of a component: one line, and one for each failure."""
    clocks = one.outcome.tallies["ghdl"].clocks if one.outcome else 0
    depth = max((proof.k or 0 for proof in one.proofs), default=0)
    cases = len({proof.case for proof in one.proofs})
    clock = one.controls[0].clock if one.controls else None
    parts = [
        f"{one.name:13} {clocks} clocks {'DIFFER' if one.differs else 'alike'} "
        f"in {one.seconds['in_step']:.1f} s",
        f"{len(one.proofs) - len(one.unproved)} of {len(one.proofs)} properties proved, "
        f"{cases} case{'s' * (cases > 1)}, k={depth}, {one.seconds['proofs']:.1f} s",
        "mutant NOT FOUND" if clock is None else f"mutant found in clock {clock}",
    ]
    wrong = [one.differs] if one.differs else []
    wrong += [f"{proof.name} {proof.verdict} with {proof.case}"
              + (f" in clock {proof.clock}" if proof.clock is not None else "")
              + (f", see {proof.trace}" if proof.trace else "") for proof in one.unproved]
    return "\n".join(["   ".join(parts), *(f"  {text}" for text in wrong)])


def figures(one: Comparison) -> dict[str, Any]:
    """Return all figures of a component, for JSON."""
    assert one.outcome is not None
    return {
        "name": one.name, "entity": one.entity, "good": one.good, "engine": one.engine,
        "clocks": one.outcome.tallies["ghdl"].clocks, "checksum": f"{one.outcome.checksum:016x}",
        "clocks_per_second": {name: round(tally.speed)
                              for name, tally in one.outcome.tallies.items()},
        "difference": one.differs,
        "seconds": {what: round(seconds, 2) for what, seconds in one.seconds.items()},
        "proofs": [asdict(proof) for proof in one.proofs],
        "controls": [asdict(control) for control in one.controls],
    }


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.vhdl", description=ABOUT, epilog=EPILOG)
    parser.add_argument("components", metavar="COMPONENT", nargs="*", help="what to compare; all")
    parser.add_argument("--list", action="store_true", help="list the components, and exit")
    parser.add_argument("--cycles", metavar="N", type=whole(1), default=100_000,
                        help="clocks in step (default: %(default)s)")
    parser.add_argument("--seed", metavar="S", type=whole(0), default=1,
                        help="seed of the stimulus (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to a file")
    parser.add_argument("--traces", metavar="FOLDER", type=Path, default=TRACES,
                        help="folder for waveforms of failed proofs (default: build/vhdl of "
                             "the checkout)")
    parser.add_argument("--jobs", metavar="N", type=whole(1, 256),
                        help="tasks in parallel (default: all cores)")
    args = parser.parse_args(argv)

    names = [known(name, REFERENCES, "component described in VHDL")
             for name in dict.fromkeys(args.components)] or list(REFERENCES)
    if args.list:
        for name in names:
            say(f"{name:13} tb/vhdl/{REFERENCES[name].entity}.vhd")
        return 0
    check_output(args.json)
    for reason in (GHDLEngine.missing(), missing()):
        if reason:
            raise UserError(reason)
    if note := why_slow():
        warn(note)

    began = time.monotonic()
    try:
        with Progress(steps(names), "comparisons", "comparing") as progress:
            compared = run(names, cycles=args.cycles, seed=args.seed, jobs=args.jobs,
                           traces=args.traces, advance=progress.advance)
    except EngineError as error:
        raise UserError(str(error)) from error
    seconds = time.monotonic() - began
    for one in compared:
        say(line(one))
    good = sum(one.good for one in compared)
    say(f"{good} of {len(compared)} are the same in VHDL, in {seconds:.0f} s")
    if args.json is not None:
        facts = {
            "seed": args.seed, "cycles": args.cycles, "seconds": round(seconds, 1),
            "versions": {"ghdl": GHDLEngine.version(), **versions()},
            "components": [figures(one) for one in compared]}
        write_atomically(args.json, (json.dumps(facts, indent=2) + "\n").encode())
        say(f"wrote {args.json}")
    return 0 if good == len(compared) else 1


if __name__ == "__main__":
    raise SystemExit(main())
