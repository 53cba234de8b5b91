"""That every property can fail: for each, a mutant of the design that breaks it.

Random inputs, and what a bench does, break most of them in the bit-parallel simulation. For those
that are left, a formula has the choice of the mutant, of all inputs, and where the property is
about upsets of the state in which it begins.
"""

import os
import re
import signal
import subprocess
import tempfile
import time
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from ..contracts import Component
from ..contracts.contract import Case
from ..contracts.proof import SMTBMC, environment, named, prepare
from ..rtlil import canonical
from .benches import bench_of, component_of, kind_of, run_bench
from .judge import by_chance
from .netlist import Mutable, Mutant, listed

__all__ = ["Kill", "kills"]

#: Mutants in a simulation, clocks of random inputs, mutants in a formula, and its seconds.
SIMULATED, CLOCKS, FORMULA, SECONDS = 400, 1500, 100, 60
SEED = 1


@dataclass
class Kill:
    """A property and a mutant that breaks it.

    Attributes
    ----------
    component, name : str
        Whose property, and which.
    lemma : bool
        An induction needs it: no mutant has to break it.
    case : str
        Parameters of the component; ``bench`` if they are those of its bench.
    mutant : str
        The mutant, by its canonical name; empty if none was found.
    clock : int or None
        Clock in which the property breaks, from power-up or from the upset.
    seconds : float
        Time that the search in this case took, with all properties that were looked for.
    """

    component: str
    name: str
    lemma: bool = False
    case: str = ""
    mutant: str = ""
    clock: int | None = None
    seconds: float = 0.0


def kills(name: str, component: Component, lock: AbstractContextManager) -> list[Kill]:
    """Look for a mutant that breaks each property of a component.

    Parameters
    ----------
    name : str
        Of the component.
    component : Component
        Its contract.
    lock : context manager
        Held while gateware is elaborated.
    """
    with lock:
        found = {each.name: Kill(name, each.name, each.lemma)
                 for each in component.properties().values()}
    for search in (_simulated, _solved):
        for case in _cases(component):
            left = {each.name for each in found.values() if not each.mutant and not each.lemma}
            if not left:
                break
            began = time.monotonic()
            for one, (mutant, clock) in search(component, case, left, lock).items():
                kill = found[one]
                kill.case, kill.mutant, kill.clock = str(case or "bench"), str(mutant), clock
                kill.seconds = round(time.monotonic() - began, 1)
    return list(found.values())


def _cases(component: Component) -> Iterator[Case | None]:
    """Give the cases to look at; None is that of the bench."""
    if bench_of(kind_of(component)) is not None:
        yield None
    yield from (case for case in component.cases if not case.real)


def _simulated(component: Component, case: Case | None, left: Collection[str],
               lock: AbstractContextManager) -> dict[str, tuple[Mutant, int]]:
    if case is not None and case.upset:  # a simulation has those properties in the other cases
        return {}
    bench = bench_of(kind_of(component)) if case is None else None
    with lock:
        dut = component_of(bench) if bench else component.make(**(case or Case()).parameters)
        mutable = Mutable(component, dut)
    netlist = mutable.netlist(mutable.choose(SIMULATED, SEED))
    netlist.assertions = [each for each in netlist.assertions if each.name in left]
    rows = run_bench(bench, netlist, []).stimulus if bench else []
    witnesses: dict[str, tuple[int, int]] = {}
    by_chance(netlist, range(len(netlist.mutants)), SEED, CLOCKS, rows, witnesses=witnesses)
    return {name: (netlist.mutants[number], clock)
            for name, (number, clock) in witnesses.items()}


def _solved(component: Component, case: Case | None, left: Collection[str],
            lock: AbstractContextManager) -> dict[str, tuple[Mutant, int]]:
    if case is None:
        return {}
    with lock:
        contract = component.contract(case, only=left, broken=True)
        wanted = set(contract.properties) & set(left)
        if not wanted:
            return {}
        text = canonical(named(contract.rtlil()))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        chosen = listed(text, folder, FORMULA, SEED)
        width = len(chosen).bit_length()
        applied = [f"{mutant.command} -ctrl mutant {width} {number}"
                   for number, mutant in enumerate(chosen, start=1)]
        # In every clock the same mutant: that of number 0 is none.
        (folder / "constant.smtc").write_text(
            "always -1\nassume (= [dut.mutant] [-1:dut.mutant])\n")
        prepare(folder, upset=case.upset, read="read_rtlil base.il", applied="; ".join(applied))
        _solve(folder, component.depth)
        return dict(_witnesses(folder, chosen, wanted))


def _solve(folder: Path, clocks: int) -> None:
    """Let the solver look for covers as long as it may; what it found is in its output."""
    command = [*SMTBMC, "-s", "z3", "--noprogress", "-c", "-t", str(clocks), "--smtc",
               "constant.smtc", "--dump-vcd", "cover%.vcd", "covers.smt2"]
    with (folder / "output.txt").open("w") as output:
        process = subprocess.Popen(command, cwd=folder, env=environment(), stdout=output,
                                   stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT,
                                   start_new_session=True)
        try:
            process.wait(SECONDS)
        except subprocess.TimeoutExpired:
            pass
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def _witnesses(folder: Path, mutants: list[Mutant], wanted: Collection[str]
               ) -> Iterator[tuple[str, tuple[Mutant, int]]]:
    reached: list[tuple[str, int]] = []
    for line in (folder / "output.txt").read_text().splitlines():
        if match := re.search(r"Reached cover statement in step (\d+) at top: property:(\S+)\?",
                              line):
            reached.append((match[2], int(match[1])))
        elif match := re.search(r"Writing trace to VCD file: (\S+)", line):
            number = _level(folder / match[1], "mutant")
            if number:
                for name, clock in reached:
                    if name in wanted:
                        yield name, (mutants[number - 1], clock)
            reached.clear()


def _level(trace: Path, name: str) -> int:
    """Return the first level of a signal in a waveform."""
    text = trace.read_text()
    match = re.search(rf"\$var \w+ \d+ (\S+) (?:\S+\.)?{name}(?: \[[^\]]*\])? \$end", text)
    if not match:
        return 0
    level = re.search(rf"^(?:b([01]+) |([01])){re.escape(match[1])}$", text, re.M)
    return int(level[1] or level[2], 2) if level else 0
