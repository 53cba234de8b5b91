"""What runs a stimulus: the engines and the model, of the machines that can be cosimulated."""

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from operator import attrgetter
from os import PathLike
from typing import ClassVar, Protocol

import numpy as np
from amaranth import Value
from numpy.typing import NDArray

from fresa.machines import Positioner, Single
from fresa.machines.mill import MillTiming
from fresa.machines.positioner import PositionerTiming
from fresa.machines.single import FINE, TOP_SPEED, SingleTiming
from fresa.motion import ramp_rates

from . import boards, desk
from .design import Design
from .engines import ENGINES, Engine, source
from .engines.pysim import AmaranthEngine
from .models.mill import MillModel
from .models.positioner import PositionerModel
from .models.single import SingleModel
from .stimulus import Chance, Stimulus, chance, directed, held, moods, random_blocks
from .terminal import chance as typed_by_chance
from .terminal import directed as typed_in_turn
from .vhdl import REFERENCES

__all__ = ["FAST", "MACHINES", "MODEL", "Machine", "ModelRunner", "Runner", "close_all",
           "make_runners", "stimuli"]

#: Name of the model among the engines.
MODEL = "model"

#: engines that run millions of clocks.
FAST = ("cxxrtl", "verilator", "netlist")

#: Most rows of the stimulus that wait for the machine: they are made by the model, which is slow.
DIRECTED = 50_000


class Runner(Protocol):
    """What runs a stimulus: an `Engine`, or a model."""

    def apply(self, stimulus: Stimulus, outputs: Sequence[str], /) -> Mapping[str, NDArray]:
        """Apply some rows; give the outputs."""
        ...

    def close(self) -> None:
        """Be done."""


class Model(Protocol):
    """A machine in plain Python, clock by clock."""

    Inputs: ClassVar[type]
    """A dataclass of its input pins, all 0 unless given."""

    def outputs(self, pins, /) -> object:
        """Return the outputs in this clock, as attributes."""
        ...

    def edge(self, pins, /) -> None:
        """Go to the next clock."""


@dataclass(frozen=True)
class Machine:
    """A machine that can be cosimulated.

    Attributes
    ----------
    name : str
        What people call it.
    design : callable
        Makes its design.
    directed : callable
        Gives, of a seed, so many clocks of stimulus that goes through what there is to see; fewer
        if there is no more.
    chance : callable
        Gives stimulus by chance.
    model : callable, optional
        Makes its model, if it has one.
    without : mapping of str to str
        Engines that cannot run it, and why.
    """

    name: str
    design: Callable[[], Design]
    directed: Callable[[int, int], Stimulus]
    chance: Chance
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


def _mill(name: str, guard: bool) -> Machine:
    """Shorten every time, so that much happens in few clocks."""
    timing, z_travel = MillTiming(period=3, scan_bits=4, jog_period=2), 5

    def model() -> MillModel:
        return MillModel(period=timing.period, scan_bits=timing.scan_bits, z_travel=z_travel,
                         jog_period=timing.jog_period)

    return Machine(
        name, functools.partial(boards.mill, timing=timing, z_travel=z_travel, guard=guard),
        directed=lambda seed, clocks: directed(model(), seed, clocks), chance=chance, model=model)


_ON_A_LINE = {"ghdl": "it has no description in VHDL",
              **dict.fromkeys(("netlist", "netlist-icarus"),
                              "it takes block RAMs, of which Yosys has no model")}
"""What cannot run a machine on a serial line."""


def _single(name: str, timing: SingleTiming, ramp: int = 0, top_speed: int = TOP_SPEED) -> Machine:
    """Shorten texts. The model counts rates in the unit of the ramp, if there is one."""
    greeting, help_text = b"!\r\n", b"?\r\n"
    rate, modulus = timing.rate * (FINE if ramp else 1), timing.modulus * (FINE if ramp else 1)

    def model() -> SingleModel:
        rates = ramp_rates(acceleration=ramp, top=top_speed * rate, modulus=modulus,
                           clock=timing.clock) if ramp else ()
        return SingleModel(bit=timing.bit, modulus=modulus, rate=rate, ramp=rates,
                           greeting=greeting, help_text=help_text)

    return Machine(
        name, lambda: boards.component("single", Single(
            timing=timing, ramp=ramp, top_speed=top_speed, greeting=greeting, help_text=help_text)),
        directed=lambda seed, clocks: typed_in_turn(model(), seed, clocks),
        chance=functools.partial(typed_by_chance, timing.bit), model=model,
        without=_ON_A_LINE)


def _positioner() -> Machine:
    """Shorten every time beside a step of the motors."""
    bit = 16
    timing = PositionerTiming(clock=1000 * bit, baud=1000, top_speed=1500, width=2, low=3, setup=2,
                          hold=4, settle=30, report=10_000)
    options = {"backlash": (3, 0, 12), "limit_ends": ("X-", "Y+", "X+")}
    return Machine(
        "positioner",
        lambda: boards.component("positioner", Positioner(timing=timing, **options)),
        directed=functools.partial(desk.directed, bit), chance=functools.partial(desk.chance, bit),
        model=lambda: PositionerModel(timing=timing, bit=bit, **options), without=_ON_A_LINE)


def _described(name: str) -> Machine:
    """Take a component and its first parameters from the table of the VHDL."""
    reference = REFERENCES[name]

    def fields() -> dict[str, Sequence[int]]:
        return {pin: reference.packed.get(pin, [len(Value.cast(signal))])
                for pin, signal in machine.shared.inputs.items()}

    machine = Machine(
        name, functools.partial(boards.described, name),
        directed=lambda seed, clocks: held(machine.shared.inputs, reference.directed, clocks),
        chance=lambda seed, block, rows: moods(fields(), seed, block, rows))
    return machine


MACHINES = {
    "mill": _mill("mill", guard=False),
    "mill-guarded": _mill("mill-guarded", guard=True),
    "single": _single("single", SingleTiming.real(clock=48_000, baud=3000)),
    "single-ramp": _single("single-ramp", SingleTiming.real(clock=240_000, baud=15_000, turn=5),
                           ramp=150_000, top_speed=25_000),
    "positioner": _positioner(),
    **{name: _described(name) for name in REFERENCES if name != "mill"},
}
"""The machines, the mill also guarded, `single` also with a ramp, and the components of
which there is one in VHDL."""


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
    machine: Machine, names: Iterable[str], kinds: Mapping[str, type[Engine]] = ENGINES,
    vcd: Mapping[str, PathLike[str]] | None = None,
) -> dict[str, Runner]:
    """Make engines, or the model, at power-up.

    Parameters
    ----------
    machine : Machine
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
            if name == MODEL and machine.model:
                runners[name] = ModelRunner(machine.model())
            else:
                # Amaranth's simulator elaborates for itself, and gateware lets that be done once.
                again = issubclass(kinds[name], AmaranthEngine)
                design = machine.design() if again else machine.shared
                runners[name] = kinds[name](design, vcd=(vcd or {}).get(name))
    except BaseException:
        close_all(runners)
        raise
    return runners


def close_all(runners: Mapping[str, Runner]) -> None:
    """Close runners."""
    for runner in runners.values():
        runner.close()


def stimuli(machine: Machine, seed: int, clocks: int) -> Iterator[Stimulus]:
    """Give a stimulus in blocks: half of it is directed, if it is short, then comes chance.

    Parameters
    ----------
    machine : Machine
        Says what there is to see.
    seed : int
        The same seed and clocks give the same stimulus everywhere.
    clocks : int
        Rows of all blocks.
    """
    first = machine.directed(seed, min(-(-clocks // 2), DIRECTED))
    yield first
    yield from random_blocks(seed, clocks - len(first["rst"]), chance=machine.chance)
