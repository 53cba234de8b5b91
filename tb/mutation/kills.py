"""That every property can fail: for each, a mutant of the design that breaks it.

Random inputs, and what a bench does, break most of them in the bit-parallel simulation. For those
that are left, a formula has the choice of the mutant, of all inputs, and where the property is
about upsets of the state in which it begins. What is stated of wires no mutant of a cell can break:
for that a bit is inverted at a port of the component, or of a part of it.
"""

import os
import random
import re
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from amaranth import Cat, Const

from ..contracts import Component
from ..contracts.contract import Case, Contract
from ..contracts.proof import SMTBMC, environment, named, prepare
from ..mistake import Mistake, connections
from ..rtlil import canonical
from .benches import bench_of, component_of, kind_of, run_bench
from .formula import limit_processor
from .judge import by_chance
from .netlist import Mutable, Mutant, choose, listed

__all__ = ["Kill", "kills"]

#: By a property: a mutant that breaks it, and the clock.
_Found: TypeAlias = dict[str, tuple[str, int]]

#: Mutants in a simulation, clocks of random inputs, mutants in a formula, and its seconds.
SIMULATED, CLOCKS, FORMULA, SECONDS = 400, 1500, 100, 60
#: How often other mutants are chosen for what is left, in a simulation and in a formula.
SIMULATIONS, FORMULAS = 4, 24
#: Most bits of ports that are inverted: first of the component, then of its parts.
PORTS = 400


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


def kills(name: str, component: Component) -> list[Kill]:
    """Look for a mutant that breaks each property of a component.

    Parameters
    ----------
    name : str
        Of the component.
    component : Component
        Its contract.
    """
    stated = [(case, component.contract(case).properties.values()) for case in component.cases]
    found = {each.name: Kill(name, each.name, each.lemma)
             for _, properties in stated for each in properties}
    # Where times are those of the board little happens in few clocks: only what is stated of no
    # other case is looked for there.
    short = {each.name for case, properties in stated if not case.real for each in properties}
    searches = [*((_simulated, seed) for seed in range(1, 1 + SIMULATIONS)), (_solved, 1),
                (_connected, 1), *((_solved, seed) for seed in range(2, 1 + FORMULAS))]
    for search, seed in searches:
        for case in _cases(component):
            left = {each.name for each in found.values() if not each.mutant and not each.lemma}
            if case is not None and case.real:
                left -= short
            if not left:
                continue
            began = time.monotonic()
            for one, (mutant, clock) in search(component, case, left, seed).items():
                kill = found[one]
                kill.case, kill.mutant, kill.clock = str(case or "bench"), mutant, clock
                kill.seconds = round(time.monotonic() - began, 1)
    return list(found.values())


def _cases(component: Component) -> Iterator[Case | None]:
    """Yield the cases to look at, those of the board last; None is that of the bench."""
    if bench_of(kind_of(component)) is not None:
        yield None
    yield from sorted(component.cases, key=lambda case: case.real)


def _simulated(component: Component, case: Case | None, left: Collection[str], seed: int) -> _Found:
    if case is not None and (case.upset or case.real):  # the other cases have those properties
        return {}
    bench = bench_of(kind_of(component)) if case is None else None
    dut = component_of(bench) if bench else component.make(**(case or Case()).parameters)
    mutable = Mutable(component, dut)
    if not mutable.mutants:
        return {}
    netlist = mutable.netlist(mutable.choose(SIMULATED, seed))
    netlist.assertions = [each for each in netlist.assertions if each.name in left]
    rows = run_bench(bench, netlist, []).stimulus if bench else []
    witnesses: dict[str, tuple[int, int]] = {}
    by_chance(netlist, range(len(netlist.mutants)), seed, CLOCKS, rows, witnesses=witnesses)
    return {name: (str(netlist.mutants[number]), clock)
            for name, (number, clock) in witnesses.items()}


def _solved(component: Component, case: Case | None, left: Collection[str], seed: int) -> _Found:
    """Let a formula choose a mutant of a cell."""
    def mutate(contract: Contract, folder: Path) -> tuple[list[str], str]:
        every = listed(canonical(named(contract.rtlil())), folder)
        if not every:
            return [], ""
        # Most that is stated of a component is about its own cells, not about those of its parts.
        own = [mutant for mutant in every if not mutant.path]
        chosen = [*choose(_one_of_each_cell(own, seed), FORMULA // 2, seed),
                  *choose(every, FORMULA // 2, seed)]
        width = len(chosen).bit_length()
        commands = [f"{mutant.command} -ctrl mutant {width} {number}"
                    for number, mutant in enumerate(chosen, start=1)]
        prepare(folder, upset=contract.upset, read="read_rtlil base.il",
                applied="; ".join(commands))
        return list(map(str, chosen)), "dut.mutant"

    return _found(component, case, left, mutate)


def _one_of_each_cell(mutants: list[Mutant], seed: int) -> list[Mutant]:
    """Choose a mutant of each cell: else a wide one has nearly all of them."""
    cells: dict[tuple[str, int], list[Mutant]] = {}
    for mutant in mutants:
        cells.setdefault((mutant.cell, mutant.number), []).append(mutant)
    rng = random.Random(seed)
    return [rng.choice(each) for each in cells.values()]


def _connected(component: Component, case: Case | None, left: Collection[str], seed: int) -> _Found:
    """Let a formula choose a bit of a port that is inverted."""
    def mutate(contract: Contract, folder: Path) -> tuple[list[str], str]:
        names: list[str] = []
        switch = contract.free(range(PORTS + 1), name="mutant")
        ports = connections(contract.fragment)
        for path, port in sorted(ports.items(), key=lambda port: (port[0].count("."), port[0])):
            bits = []
            for bit in range(min(len(port), PORTS - len(names))):
                names.append(f"{path}[{bit}] inverted")
                bits.append(switch == len(names))
            wrong = Cat(bits, Const(0, len(port) - len(bits)))
            Mistake(path, lambda right, _, wrong=wrong: right ^ wrong).plant(
                contract.fragment, ports)
        (folder / "design.il").write_text(named(contract.rtlil()))
        prepare(folder, upset=contract.upset)
        return names, "mutant"

    return _found(component, case, left, mutate)


def _found(component: Component, case: Case | None, left: Collection[str],
           mutate: Callable[[Contract, Path], tuple[list[str], str]]) -> _Found:
    """Let a formula choose from mutants of a contract, which are named, by a signal."""
    if case is None:
        return {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        contract = component.contract(case, only=left, broken=True)
        if not set(contract.properties) & set(left):
            return {}
        mutants, switch = mutate(contract, folder)
        if not mutants:
            return {}
        # In every clock the same mutant: that of number 0 is none.
        (folder / "constant.smtc").write_text(
            f"always -1\nassume (= [{switch}] [-1:{switch}])\n")
        _solve(folder, component.depth)
        return {name: found for name, found in _witnesses(folder, mutants) if name in left}


def _solve(folder: Path, clocks: int) -> None:
    """Let the solver look for covers as long as it may; what it found is in its output."""
    command = [*SMTBMC, "-s", "z3", "--noprogress", "-c", "-t", str(clocks), "--smtc",
               "constant.smtc", "--dump-vcd", "cover%.vcd", "covers.smt2"]
    with (folder / "output.txt").open("w") as output:
        process = subprocess.Popen(command, cwd=folder, env=environment(), stdout=output,
                                   stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT,
                                   start_new_session=True, preexec_fn=limit_processor(SECONDS))
        try:
            process.wait()
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def _witnesses(folder: Path, mutants: Sequence[str]) -> Iterator[tuple[str, tuple[str, int]]]:
    reached: list[tuple[str, int]] = []
    for line in (folder / "output.txt").read_text().splitlines():
        if match := re.search(r"Reached cover statement in step (\d+) at top: property:(\S+)\?",
                              line):
            reached.append((match[2], int(match[1])))
        elif match := re.search(r"Writing trace to VCD file: (\S+)", line):
            number = _level(folder / match[1], "mutant")
            if 0 < number <= len(mutants):
                for name, clock in reached:
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
