"""Who plays a stimulus: the engines and the model, of the machines that can be cosimulated."""

import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from operator import attrgetter
from os import PathLike
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fresa.machines.mill import MillPace

from . import boards
from .design import Design
from .engines import ENGINES, Engine, source
from .engines.pysim import AmaranthEngine
from .models.mill import MillInputs, MillModel
from .stimulus import Stimulus, directed, random_blocks

__all__ = ["FAST", "MACHINES", "MODEL", "Machine", "ModelPlayer", "Player", "close_all",
           "make_players", "stimuli"]

#: Name of the model among the engines.
MODEL = "model"

#: Engines that play millions of clocks.
FAST = ("cxxrtl", "verilator", "netlist")

#: Most rows of the stimulus that wait for the machine: they are made by the model, which is slow.
DIRECTED = 50_000


class Player(Protocol):
    """What plays a stimulus: an `Engine`, or a model."""

    def play(self, stimulus: Stimulus, outputs: Sequence[str], /) -> Mapping[str, NDArray]:
        """Play some rows; give the outputs."""
        ...

    def close(self) -> None:
        """Be done."""


@dataclass(frozen=True)
class Machine:
    """A machine that can be cosimulated.

    Attributes
    ----------
    name : str
        What people call it.
    design : callable
        Makes its design.
    model : callable
        Makes its model.
    """

    name: str
    design: Callable[[], Design]
    model: Callable[[], MillModel]

    @functools.cached_property
    def shared(self) -> Design:
        """A design that is elaborated already, for all engines but Amaranth's."""
        design = self.design()
        source.rtlil(design)
        return design


_PACE = MillPace(period=3, scan_bits=4, jog_period=2)
_TRAVEL = 5

MACHINES = {"mill": Machine(
    "mill",
    design=lambda: boards.mill(pace=_PACE, z_travel=_TRAVEL),
    model=lambda: MillModel(period=_PACE.period, scan_bits=_PACE.scan_bits, z_travel=_TRAVEL,
                            jog_period=_PACE.jog_period),
)}
"""The machines, with every time shortened so that much happens in few clocks."""


class ModelPlayer:
    """A model as a `Player`."""

    _INPUTS = [field.name for field in fields(MillInputs)]

    def __init__(self, model: MillModel) -> None:
        self._model = model

    def play(self, stimulus: Stimulus, outputs: Sequence[str], /) -> dict[str, NDArray]:
        """Play some rows; give the outputs."""
        model, pins = self._model, MillInputs()
        columns = [stimulus[name].astype(int).tolist() for name in self._INPUTS]
        seen = []
        for row in zip(*columns, strict=True):
            for name, level in zip(self._INPUTS, row, strict=True):
                setattr(pins, name, level)
            seen.append(model.outputs(pins))
            model.edge(pins)
        return {name: np.fromiter(map(attrgetter(name), seen), np.int64, len(seen))
                for name in outputs}

    def close(self) -> None:
        """Do nothing: it holds nothing."""


def make_players(
    machine: Machine, names: Iterable[str], kinds: Mapping[str, type[Engine]] = ENGINES,
    vcd: Mapping[str, PathLike[str]] | None = None,
) -> dict[str, Player]:
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
    players: dict[str, Player] = {}
    try:
        for name in names:
            if name == MODEL:
                players[name] = ModelPlayer(machine.model())
            else:
                # Amaranth's simulator elaborates for itself, and gateware lets that be done once.
                again = issubclass(kinds[name], AmaranthEngine)
                design = machine.design() if again else machine.shared
                players[name] = kinds[name](design, vcd=(vcd or {}).get(name))
    except BaseException:
        close_all(players)
        raise
    return players


def close_all(players: Mapping[str, Player]) -> None:
    """Close players."""
    for player in players.values():
        player.close()


def stimuli(machine: Machine, seed: int, clocks: int) -> Iterator[dict[str, NDArray]]:
    """Give a stimulus in blocks: half of it waits for the machine, if it is short, then chance.

    Parameters
    ----------
    machine : Machine
        Its model says what to wait for.
    seed : int
        The same seed and clocks give the same stimulus everywhere.
    clocks : int
        Rows of all blocks.
    """
    waiting = min(-(-clocks // 2), DIRECTED)
    yield directed(machine.model(), seed, waiting)
    yield from random_blocks(seed, clocks - waiting)
