"""The benches of ``python -m tb`` against all mutants of a component at once.

A bench runs once, on the component as it is, and every mutant runs beside it, in a bit of its own.
Where a bench checks something, the mutants that fail there are killed. Where it only looks, to
decide what to do next, a mutant that shows something else would be treated otherwise from there on:
it is run again, alone. So each mutant gets exactly what the bench does with it.
"""

import functools
import gc
import warnings
from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from amaranth import Signal, Value
from amaranth.hdl import UnusedElaboratable, ValueCastable
from amaranth.hdl._ast import Slice
from amaranth.lib import wiring
from numpy.typing import NDArray

from ..bench import Bench, CheckFailed, Run, port
from ..benches import groups
from ..contracts import Component
from ..design import Design
from ..rtlil import fingerprint
from ..runners import Dut, ModelRunner
from ..stimulus import Stimulus
from .netlist import MutationError, Netlist
from .parallel import ParallelSimulation

__all__ = ["Verdicts", "bench_of", "component_of", "kind_of", "model_key", "run_bench",
           "run_model", "unused"]


class _Found(Exception):
    """Carries the component that a bench runs out of it."""


class _Look(Run):
    """Stops a bench where it has made its component."""

    def simulate(self, dut: wiring.Component, test: Callable, *runners: Callable,
                 inside: Sequence[str] = (), deadline: int = 0) -> None:
        raise _Found(dut)

    def engine(self, design: Design, *, inside: Sequence[str] = ()) -> NoReturn:
        raise _Found(None)  # a design, of which a component may be a part


def component_of(bench: Bench) -> wiring.Component:
    """Make the component of a bench as the bench does, not elaborated yet."""
    if (found := _component_of(bench)) is None:
        raise MutationError(f"the bench {bench.name} runs no component by itself")
    return found


def _component_of(bench: Bench) -> wiring.Component | None:
    try:
        bench.function(_Look())
    except _Found as found:
        return found.args[0]
    return None


def kind_of(component: Component) -> type[wiring.Component]:
    """Return the class of a component."""
    with unused():
        return type(component.make(**component.cases[0].parameters))


@functools.cache
def bench_of(kind: type[wiring.Component]) -> Bench | None:
    """Find the bench that runs components of a class, if there is one."""
    with unused():
        return next((bench for bench in [*groups()["components"], *groups()["machine"]]
                     if type(_component_of(bench)) is kind), None)


_quiet: ContextVar[bool] = ContextVar("_quiet", default=False)


@contextmanager
def unused() -> Iterator[None]:
    """Make components that are never elaborated, without a warning; may be nested."""
    if _quiet.get():
        yield
        return
    token = _quiet.set(True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UnusedElaboratable)
            yield
            gc.collect()  # the warning would come when they go, which would be later
    finally:
        _quiet.reset(token)


@dataclass
class Verdicts:
    """What a bench does with mutants.

    Attributes
    ----------
    killed : dict of int to int
        The clock in which a mutant was found wrong.
    stimulus : list of list of int
        Levels that it gave to the inputs of the component as it is, bit by bit, a row a clock.
    key : str
        Of the stimulus and of what it checked.
    """

    killed: dict[int, int]
    stimulus: list[list[int]]
    key: str


def run_bench(bench: Bench, netlist: Netlist, mutants: Sequence[int]) -> Verdicts:
    """Run a bench on the component as it is and on some mutants of it.

    Raises
    ------
    MutationError
        If the component as it is does not pass.
    """
    with unused():  # each run of the bench makes a component, which the netlist stands for
        try:
            return _run_bench(bench, netlist, mutants)
        except CheckFailed as failure:
            raise MutationError(f"its bench fails, without a mutant: {failure}") from failure


def _run_bench(bench: Bench, netlist: Netlist, mutants: Sequence[int]) -> Verdicts:
    run = _ParallelRun(netlist, mutants)
    bench.function(run)
    patience = 4 * run.clock + 1200
    killed, left = run.killed, sorted(run.astray)
    while left:
        # The first of them leads now. Those that show the same go its way, to whatever end.
        again = _ParallelRun(netlist, left, lead=1, patience=patience)
        fails = False
        try:
            bench.function(again)
        except MutationError:
            raise
        except Exception:  # a bench may also stumble over what it never expected to see
            fails = True
        killed |= again.killed
        if fails:
            killed |= dict.fromkeys(set(left) - again.astray - set(again.killed), again.clock)
        left = sorted(again.astray)
    return Verdicts(killed, run.stimulus, fingerprint(repr((run.stimulus, run.checked))))


def model_key(dut: Dut, netlist: Netlist, seed: int, clocks: int) -> str:
    """Return a hash of what :func:`run_model` compares with."""
    return fingerprint(*(
        repr((_bits(stimulus, netlist.inputs), _bits(expected, netlist.outputs)))
        for stimulus, expected in _expected(dut, netlist, seed, clocks)))


def _expected(dut: Dut, netlist: Netlist, seed: int, clocks: int
              ) -> Iterator[tuple[Stimulus, Mapping[str, NDArray]]]:
    """Yield the stimuli of a comparison with a model, each from power-up, and what it gives."""
    assert dut.model is not None
    for stimulus in (dut.directed(seed, clocks // 2), dut.random(seed, 0, clocks - clocks // 2)):
        yield stimulus, ModelRunner(dut.model()).apply(stimulus, list(netlist.outputs))


def run_model(dut: Dut, netlist: Netlist, mutants: Sequence[int], seed: int,
              clocks: int) -> dict[int, int]:
    """Compare every output of every clock with the model, as ``tools.cosim`` does.

    Parameters
    ----------
    dut : Dut
        The machine with its times, its model and its stimulus.
    netlist, mutants
        The machine, and which mutants of it.
    seed, clocks : int
        Of the stimulus: half of it is directed, half is random.

    Returns
    -------
    dict of int to int
        The clock in which each mutant differs that does.

    Raises
    ------
    MutationError
        If the machine as it is differs.
    """
    found: dict[int, int] = {}
    outputs = [net for bits in netlist.outputs.values() for net in bits]
    for stimulus, expected in _expected(dut, netlist, seed, clocks):
        left = [number for number in mutants if number not in found]
        simulation = ParallelSimulation(netlist, left, outputs)
        levels = _bits(stimulus, netlist.inputs)
        wanted = _bits(expected, netlist.outputs)
        for clock, (row, right) in enumerate(zip(levels, wanted, strict=True)):
            simulation.state, seen = simulation.look(
                [simulation.every if bit else 0 for bit in row])
            wrong = 0
            for bit, level in zip(right, seen, strict=True):
                wrong |= level ^ (simulation.every if bit else 0)
            if wrong & 1:
                raise MutationError(f"the machine is not its model in clock {clock}")
            if wrong:
                for place, number in enumerate(simulation.mutants, start=1):
                    if wrong >> place & 1:
                        found.setdefault(number, clock)
                simulation = simulation.without(set(found))
    return found


def _bits(rows: Mapping[str, NDArray], ports: Mapping[str, list[int]]) -> list[tuple[int, ...]]:
    """Spread rows of numbers over the bits of ports, a row a clock; what has none stays 0."""
    none = np.zeros_like(next(iter(rows.values())))
    return list(zip(*((rows.get(name, none).astype(int) >> place & 1).tolist()
                      for name, bits in ports.items() for place in range(len(bits))),
                    strict=True))


class _ParallelRun(Run):
    """A run of a bench on a bit-parallel simulation, of which one bit is what the bench sees.

    Attributes
    ----------
    killed : dict of int to int
        Mutants that failed a check, and when.
    astray : set of int
        Mutants that would have been treated otherwise: nothing is known of them.
    """

    def __init__(self, netlist: Netlist, mutants: Sequence[int], lead: int = 0,
                 patience: int | None = None) -> None:
        super().__init__()
        self._netlist, self._mutants, self._lead = netlist, list(mutants), lead
        self._patience = patience
        self.killed: dict[int, int] = {}
        self.astray: set[int] = set()
        self.stimulus: list[list[int]] = []
        self.checked: list[tuple[int, str, str]] = []

    def simulate(self, dut: wiring.Component, test: Callable, *runners: Callable,
                 inside: Sequence[str] = (), deadline: int = 10_000) -> None:
        clocks = 0
        self._clock = lambda: clocks
        if self._patience is not None:  # a mutant that hangs need not hang for long
            deadline = min(deadline, self._patience)
        context = self._context = _Context(self._netlist, self._mutants, self._lead, dut, self.rst)
        waiting: list[tuple[Coroutine, Any]] = [(play(context), None)
                                                for play in (test, *runners)]
        try:
            while True:
                triggers = []
                for place, (coroutine, values) in enumerate(waiting):
                    try:
                        triggers.append(coroutine.send(values))
                    except StopIteration:
                        if not place:
                            return
                        triggers.append(())
                    self._sort()
                sampled = [[context.get(value) for value in trigger] for trigger in triggers]
                self._sort()
                self.stimulus.append([bit & 1 for bit in context.inputs])
                context.edge()
                clocks += 1
                if clocks > deadline:
                    self.expect("the bench", "still waiting", "over")
                waiting = [(coroutine, values) for (coroutine, _), values, trigger
                           in zip(waiting, sampled, triggers, strict=True)
                           if trigger != ()]
        finally:
            self._sort()
            for coroutine, _ in waiting:
                coroutine.close()

    def expect(self, what: str, seen: object, expected: object, *, bits: int | None = None) -> None:
        self.checked.append((self.clock, what, repr(expected)))
        super().expect(what, seen, expected, bits=bits)

    def see(self, ctx: Any, dut: Any, **expected: int) -> None:
        for name, value in expected.items():
            self.checked.append((self.clock, name, repr(int(value))))
            bits = ctx.bits(port(dut, name))
            wrong = 0
            for place, bit in enumerate(bits):
                wrong |= bit ^ (ctx.every if value >> place & 1 else 0)
            self._sort()
            led = wrong >> self._lead & 1
            # Where the one that leads is wrong this is the end, and who is not wrong goes on.
            ctx.astray |= ctx.every & ~wrong if led else 0
            self._sort()
            for number in ctx.drop(wrong):
                self.killed[number] = self.clock
            if led:
                super().see(ctx, dut, **{name: value})

    async def until(self, ctx: Any, dut: Any, *, within: int = 1000, **expected: int) -> None:
        for _ in range(within):
            there = ctx.every
            for name, value in expected.items():
                for place, bit in enumerate(ctx.bits(port(dut, name))):
                    there &= bit if value >> place & 1 else bit ^ ctx.every
            led = there >> self._lead & 1
            ctx.astray |= there ^ (ctx.every if led else 0)
            if led:
                return
            await ctx.tick()
        self.see(ctx, dut, **expected)

    def _sort(self) -> None:
        """Take out of the run what was looked at and was not as in the bit that leads."""
        self.astray |= set(self._context.drop(self._context.astray))
        self._context.astray = 0


class _Context:
    """What a bench gets as `ctx`.

    Attributes
    ----------
    every : int
        All bits set.
    inputs : list of int
        Levels of the inputs.
    astray : int
        Bits of which something was seen that is not so in the bit that leads.
    """

    def __init__(self, netlist: Netlist, mutants: Sequence[int], lead: int,
                 dut: wiring.Component, rst: Signal) -> None:
        self._places: dict[int, tuple[bool, int]] = {}
        watch: list[int] = []
        self.inputs: list[int] = []
        members = {"_".join(map(str, path)): Value.cast(value)
                   for path, _, value in dut.signature.flatten(dut)} | {"rst": rst}
        self._signals = list(members.values())  # kept, so that no other gets its identity
        for name, bits in netlist.inputs.items():
            if name in members:  # the others are the contract's own, and stay 0
                self._places[id(members[name])] = (True, len(self.inputs))
            self.inputs += [0] * len(bits)
        for name, bits in netlist.outputs.items():
            self._places[id(members[name])] = (False, len(watch))
            watch += bits
        self._simulation = ParallelSimulation(netlist, mutants, watch)
        self._lead, self._runs = lead, self._simulation.every & ~1
        self.every, self.astray = self._simulation.every, 0
        # What an input is after power-up is what its signal says.
        for name in netlist.inputs.keys() & members.keys():
            self.set(members[name], members[name].init)  # type: ignore[attr-defined]
        self._looked: tuple[list[int], list[int]] | None = None

    def bits(self, value: Value) -> list[int]:
        """Return the levels of a value, bit by bit, of all mutants."""
        if isinstance(value, Slice):
            return self.bits(value.value)[value.start:value.stop]
        is_input, place = self._place(value)
        if is_input:
            return self.inputs[place:place + len(value)]
        if self._looked is None:
            self._looked = self._simulation.look(self.inputs)
        return self._looked[1][place:place + len(value)]

    def _place(self, value: Value) -> tuple[bool, int]:
        if id(value) not in self._places:
            raise MutationError(f"a bench looks at {value!r}, which is no port of its component")
        return self._places[id(value)]

    def get(self, value: Any) -> Any:
        """Return the level of a value in the bit that leads."""
        bits = self.bits(Value.cast(value))
        raw = 0
        for place, bit in enumerate(bits):
            led = bit >> self._lead & 1
            raw |= led << place
            self.astray |= bit ^ (self.every if led else 0)
        shape = value.shape()
        if isinstance(value, ValueCastable) and hasattr(shape, "from_bits"):
            return shape.from_bits(raw)
        if getattr(shape, "signed", False) and raw >> len(bits) - 1 & 1:
            raw -= 1 << len(bits)
        return raw

    def set(self, value: Any, level: Any) -> None:
        """Give an input its level, for all mutants."""
        if isinstance(value, ValueCastable) and hasattr(value.shape(), "const"):
            level = value.shape().const(level)
        if not isinstance(level, int):
            level = Value.cast(level).value  # type: ignore[attr-defined]
        value = Value.cast(value)
        start = 0
        width = len(value)
        while isinstance(value, Slice):
            start, value = start + value.start, value.value
        is_input, place = self._place(value)
        if not is_input:
            raise MutationError(f"a bench sets {value!r}, which is no input of its component")
        for bit in range(width):
            self.inputs[place + start + bit] = self.every if level >> bit & 1 else 0
        self._looked = None

    def tick(self) -> "_Tick":
        """Return what waits for the next clock."""
        return _Tick(self)

    def edge(self) -> None:
        """Make the rising edge of a clock."""
        if self._looked is None:
            self._looked = self._simulation.look(self.inputs)
        self._simulation.state = self._looked[0]
        self._looked = None

    def drop(self, lanes: int) -> Iterator[int]:
        """Take bits out of the run; give the numbers of their mutants."""
        lanes &= self._runs
        if lanes:
            self._runs &= ~lanes
            for place, number in enumerate(self._simulation.mutants, start=1):
                if lanes >> place & 1:
                    yield number


class _Tick:
    """A clock to wait for, and what to look at in it."""

    def __init__(self, context: _Context, values: tuple = ()) -> None:
        self._context, self._values = context, values

    def sample(self, *values: Any) -> "_Tick":
        return _Tick(self._context, (*self._values, *values))

    def __await__(self):
        rst = self._context.get(self._context._signals[-1])
        values = yield list(self._values)
        return (True, bool(rst), *values)

    async def until(self, condition: Any) -> tuple:
        while True:
            _, _, *values, done = await self.sample(condition)
            if done:
                return tuple(values)

    async def repeat(self, count: int) -> tuple:
        values: tuple = ()
        for _ in range(count):
            _, _, *values = await self  # type: ignore[assignment]
        return tuple(values)
