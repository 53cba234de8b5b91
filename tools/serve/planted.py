"""An engine whose machine has its plant: what its motors move switches what it feels."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from tb.engines import Engine
from tb.engines.base import Changes

__all__ = ["Plant", "PlantedEngine"]


class Plant(Protocol):
    """What a machine moves.

    Attributes
    ----------
    outputs : tuple of str
        Outputs that move it.
    """

    outputs: tuple[str, ...]

    @property
    def levels(self) -> Mapping[str, int]:
        """Levels of inputs, by their names."""
        ...

    @property
    def free(self) -> int:
        """Clocks, at least one, in which these stay what they are."""
        ...

    def feel(self, rows: Sequence[tuple[int, ...]]) -> None:
        """Follow clocks, and the levels of the outputs from each on."""
        ...


class PlantedEngine:
    """Runs an engine as its own `run` and `set` do, and a plant with it.

    An input that the plant switches is also on where it is set.

    Parameters
    ----------
    engine : Engine
        The machine.
    plant : Plant
        What it moves.
    """

    def __init__(self, engine: Engine, plant: Plant) -> None:
        self._engine, self._plant = engine, plant
        self._set = dict.fromkeys(plant.levels, 0)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)

    def set(self, **levels: int) -> None:
        """Set inputs of the machine."""
        self._set |= {name: level for name, level in levels.items() if name in self._set}
        self._engine.set(**{name: level for name, level in levels.items()
                            if name not in self._set})

    def run(self, clocks: int, watch: Sequence[str] = ()) -> Changes:
        """Make clocks, and return changes of the watched outputs, with rows of the plant's."""
        engine, plant = self._engine, self._plant
        outputs = [*watch, *plant.outputs]
        end, parts = engine.clock + clocks, []
        while engine.clock < end:
            engine.set(**{name: level | self._set[name] for name, level in plant.levels.items()})
            changes = engine.run(min(plant.free, end - engine.clock), outputs)
            plant.feel([*zip(changes.clock.tolist(), *(
                changes[name].tolist() for name in plant.outputs), strict=True)])
            parts.append(changes)
        return Changes(
            np.concatenate([each.clock for each in parts]),
            {name: np.concatenate([each[name] for each in parts]) for name in watch})
