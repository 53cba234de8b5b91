"""What runs a stimulus: the engines and the model of a design that can be cosimulated."""

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from operator import attrgetter
from os import PathLike
from typing import ClassVar, Protocol

import numpy as np
from amaranth import Value
from numpy.typing import NDArray

from . import boards
from .design import Design
from .engines import ENGINES, Engine, source
from .engines.pysim import AmaranthEngine
from .stimulus import Random, Stimulus, bursts, held, random_blocks
from .vhdl import REFERENCES

__all__ = ["FAST", "MODEL", "Dut", "Model", "ModelRunner", "Runner", "close_all", "described_dut",
           "make_runners", "stimuli"]

#: Name of the model among the engines.
MODEL = "model"

#: engines that run millions of clocks.
FAST = ("cxxrtl", "verilator", "netlist")

#: Most rows of the stimulus that wait for the machine: they are made by the model, which is slow.
DIRECTED = 50_000


class Model(Protocol):
    """A machine in plain Python, clock by clock."""

    Inputs: ClassVar[type]
    """A dataclass of its input pins, all 0 unless given."""

    def outputs(self, pins, /) -> object:
        """Return the outputs in this clock, as attributes."""
        ...

    def edge(self, pins, /) -> None:
        """Go to the next clock."""


class Runner(Protocol):
    """What runs a stimulus: an `Engine`, or a model."""

    def apply(self, stimulus: Stimulus, outputs: Sequence[str], /) -> Mapping[str, NDArray]:
        """Apply some rows; give the outputs."""
        ...

    def close(self) -> None:
        """Be done."""


@dataclass(frozen=True)
class Dut:
    """A design that can be cosimulated.

    Attributes
    ----------
    name : str
        The name shown to people.
    design : callable
        Makes its design.
    directed : callable
        Gives, of a seed, so many clocks of stimulus that goes through what there is to see; fewer
        if there is no more.
    random : callable
        Gives rows of random stimulus.
    model : callable, optional
        Makes its model, if it has one.
    without : mapping of str to str
        Engines that cannot run it, and why.
    """

    name: str
    design: Callable[[], Design]
    directed: Callable[[int, int], Stimulus]
    random: Random
    model: Callable[[], Model] | None = None
    without: Mapping[str, str] = field(default_factory=dict)

    @functools.cached_property
    def shared(self) -> Design:
        """A design that is elaborated already, for all engines but Amaranth's."""
        design = self.design()
        source.rtlil(design)
        return design

    @property
    def engines(self) -> list[str]:
        """Names of all that can run it, the model first."""
        return [*([MODEL] if self.model else []),
                *(name for name in ENGINES if name not in self.without)]


def described_dut(name: str) -> Dut:
    """Return a component that `tb.vhdl` describes, with the parameters of its first case there."""
    reference = REFERENCES[name]

    def fields() -> dict[str, Sequence[int]]:
        return {pin: reference.packed.get(pin, [len(Value.cast(signal))])
                for pin, signal in dut.shared.inputs.items()}

    dut = Dut(
        name, functools.partial(boards.described, name),
        directed=lambda seed, clocks: held(dut.shared.inputs, reference.directed, clocks),
        random=lambda seed, block, rows: bursts(fields(), seed, block, rows))
    return dut


class ModelRunner:
    """A model as a `Runner`."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._inputs = [each.name for each in fields(model.Inputs)]

    def apply(self, stimulus: Stimulus, outputs: Sequence[str], /) -> dict[str, NDArray]:
        """Apply some rows; give the outputs."""
        model, pins = self._model, self._model.Inputs()
        columns = [stimulus[name].astype(int).tolist() for name in self._inputs]
        seen = []
        for row in zip(*columns, strict=True):
            for name, level in zip(self._inputs, row, strict=True):
                setattr(pins, name, level)
            seen.append(model.outputs(pins))
            model.edge(pins)
        return {name: np.fromiter(map(attrgetter(name), seen), np.int64, len(seen))
                for name in outputs}

    def close(self) -> None:
        """Do nothing: it holds nothing."""


def make_runners(
    dut: Dut, names: Iterable[str], kinds: Mapping[str, type[Engine]] = ENGINES,
    vcd: Mapping[str, PathLike[str]] | None = None,
) -> dict[str, Runner]:
    """Make engines, or the model, at power-up.

    Parameters
    ----------
    dut : Dut
        What they run.
    names : iterable of str
        Names of engines, and ``model``.
    kinds : mapping of str to Engine
        The engines by name.
    vcd : mapping of str to path, optional
        Waveforms to write.
    """
    runners: dict[str, Runner] = {}
    try:
        for name in names:
            if name == MODEL and dut.model:
                runners[name] = ModelRunner(dut.model())
            else:
                # Amaranth's simulator elaborates for itself, and gateware lets that be done once.
                again = issubclass(kinds[name], AmaranthEngine)
                design = dut.design() if again else dut.shared
                runners[name] = kinds[name](design, vcd=(vcd or {}).get(name))
    except BaseException:
        close_all(runners)
        raise
    return runners


def close_all(runners: Mapping[str, Runner]) -> None:
    """Close runners."""
    for runner in runners.values():
        runner.close()


def stimuli(dut: Dut, seed: int, clocks: int) -> Iterator[Stimulus]:
    """Yield a stimulus in blocks: half of it is directed, if it is short, the rest is random.

    Parameters
    ----------
    dut : Dut
        Says what there is to see.
    seed : int
        The same seed and clocks give the same stimulus everywhere.
    clocks : int
        Rows of all blocks.
    """
    first = dut.directed(seed, min(-(-clocks // 2), DIRECTED))
    yield first
    yield from random_blocks(dut.random, seed, clocks - len(first["rst"]))
