"""The mutants of one component before its bench and its contract, in parts that can run apart."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..bench import Bench
from ..contracts.proof import versions
from ..machines import machines
from ..registry import components
from ..rtlil import fingerprint
from ..runners import Dut
from .benches import bench_of, component_of, kind_of, model_key, run_bench, run_model, unused
from .judge import Judge, Verdict, by_chance
from .netlist import Mutable, Mutant, MutationError, Netlist
from .survivors import explained

__all__ = ["Measure", "Trial", "begin", "judge", "measure", "with_a_bench"]

#: Clocks of random inputs in which properties are looked at, and of a machine beside its model.
CHANCE, MODEL = 3000, 6000


@dataclass(frozen=True)
class Measure:
    """What there is of a component.

    Attributes
    ----------
    mutants : int
        How many there are.
    key : str
        A hash of all that their fate depends on.
    gone : tuple of str
        Mutants that `survivors` has a sentence about, and that there are not.
    """

    mutants: int
    key: str
    gone: tuple[str, ...] = ()


@dataclass
class Trial:
    """Mutants of a component, and what is known of them.

    Attributes
    ----------
    name : str
        The component.
    netlist : Netlist
        It and the mutants.
    bench : str
        Name of its bench; empty if there is none.
    enough : dict of int to int
        See :class:`~tb.mutation.judge.Judge`.
    benched : dict of int to int
        Mutants that a bench found, by their numbers, and in which clock.
    shown : set of int
        Those that chance has shown at a pin.
    verdicts : dict of int to Verdict
        Those of which all is known.
    """

    name: str
    netlist: Netlist
    bench: str
    enough: dict[int, int] = field(default_factory=dict)
    benched: dict[int, int] = field(default_factory=dict)
    shown: set[int] = field(default_factory=set)
    verdicts: dict[int, Verdict] = field(default_factory=dict)

    @property
    def mutants(self) -> list[Mutant]:
        """The mutants."""
        return self.netlist.mutants

    @property
    def open(self) -> list[int]:
        """Those that formulas are to decide about."""
        return [number for number in range(len(self.mutants)) if number not in self.verdicts]


def _prepare(name: str, *, checked: bool = True) -> tuple[Mutable, Bench | None]:
    """Set up a component as its bench does, or as its contract does if it has no bench."""
    component = components()[name]
    bench = bench_of(kind_of(component))
    dut = component_of(bench) if bench else component.make(**component.cases[0].parameters)
    return Mutable(component, dut, checked=checked), bench


def with_a_bench() -> Mapping[str, str]:
    """Return the names of the benches of components, by the components that have one."""
    return _with_a_bench(tuple(components()))


@functools.cache
def _with_a_bench(names: Sequence[str]) -> Mapping[str, str]:
    with unused():
        found = {name: bench_of(kind_of(components()[name])) for name in names}
    return {name: bench.name for name, bench in found.items() if bench is not None}


def measure(name: str) -> Measure:
    """Count the mutants of a component."""
    mutable, bench = _prepare(name)
    texts = [mutable.text, *versions().values()]
    netlist = mutable.netlist([])
    if bench is not None:
        texts.append(run_bench(bench, netlist, []).key)
    if (dut := _compared(name)) is not None:
        texts.append(model_key(dut, netlist, 0, MODEL))
    names = set(map(str, mutable.mutants))
    gone = (mutant for component, mutant in explained()
            if component == name and mutant not in names)
    return Measure(len(mutable.mutants), fingerprint(*texts), tuple(gone))


def _compared(name: str) -> Dut | None:
    """Return the machine of that name as its bench makes it, to be compared with its model."""
    machine = machines().get(name)
    if machine is None or machine.model is None:
        return None
    return machine.dut(name, machine.bench_options)


def begin(name: str, count: int, seed: int, *, checked: bool = True) -> Trial:
    """Choose mutants of a component, and do with them what takes no formulas.

    Parameters
    ----------
    name : str
        The component.
    count : int
        How many.
    seed : int
        Of the choice, and of all chance.
    checked : bool
        With it false there is neither a contract nor a bench: a control.
    """
    mutable, bench = _prepare(name, checked=checked)
    netlist = mutable.netlist(mutable.choose(count, seed))
    trial = Trial(name, netlist, bench.name if bench else "")
    if not checked:
        return trial
    own = Judge(netlist, seconds=60)
    if not own.proves():
        raise MutationError("its contract is not proved, with the parameters of its bench")
    trial.enough = own.enough
    every = range(len(netlist.mutants))
    rows: list[list[int]] = []
    if bench is not None:
        benched = run_bench(bench, netlist, every)
        trial.benched, rows = benched.killed, benched.stimulus
    if (dut := _compared(name)) is not None:
        left = [number for number in every if number not in trial.benched]
        trial.benched |= run_model(dut, netlist, left, seed, MODEL)
    broken, trial.shown = by_chance(netlist, every, seed, CHANCE, rows)
    for number in broken:
        trial.verdicts[number] = Verdict("broken", bench=trial.benched.get(number))
    return trial


def judge(trial: Trial, numbers: list[int]) -> dict[int, Verdict]:
    """Decide about some mutants by formulas."""
    # What one process has worked out for a component serves for the next mutants of it.
    key = fingerprint(repr((trial.name, trial.netlist.gates, trial.enough)))
    if key not in _judges:
        _judges.clear()
        _judges[key] = Judge(trial.netlist, enough=trial.enough)
    judge = _judges[key]
    return {number: judge.verdict(number, trial.benched.get(number),
                                  shown=number in trial.shown) for number in numbers}


_judges: dict[str, Judge] = {}
