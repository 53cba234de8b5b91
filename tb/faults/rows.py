"""Rows of input levels, of which work is made: each for some clocks, or until a machine is idle."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..stimulus import Stimulus

__all__ = ["Row", "Rows", "rows_of_stimulus"]


@dataclass
class Row:
    """Levels of all inputs for some clocks, and until the machine is idle if it `waits`.

    After a reset, and only there, the work goes on with the next row that `begins`, if any does.
    """

    levels: tuple[int, ...]
    clocks: int
    waits: bool = False
    begins: bool = False


@dataclass(frozen=True)
class Rows:
    """Rows for the loops.

    Attributes
    ----------
    levels : array of uint64
        A row of inputs, in the order of the design, for each row.
    clocks : array of int64
        Clocks of each row.
    waits, begins : array of uint8
        See `Row`.
    """

    levels: NDArray[np.uint64]
    clocks: NDArray[np.int64]
    waits: NDArray[np.uint8]
    begins: NDArray[np.uint8]

    @classmethod
    def of(cls, rows: Iterable[Row]) -> "Rows":
        """Write down some."""
        rows = list(rows)
        return cls(np.array([row.levels for row in rows], np.uint64),
                   np.array([row.clocks for row in rows], np.int64),
                   np.array([row.waits for row in rows], np.uint8),
                   np.array([row.begins for row in rows], np.uint8))

    def __len__(self) -> int:
        return len(self.clocks)


def rows_of_stimulus(stimulus: Stimulus, inputs: Iterable[str]) -> Rows:
    """Write down levels of every clock, of the inputs of a design in their order."""
    levels = np.stack([stimulus[name].astype(np.uint64) for name in inputs], axis=1)
    begins = np.flatnonzero(np.r_[True, (levels[1:] != levels[:-1]).any(axis=1)])
    clocks = np.diff(begins, append=len(levels))
    none = np.zeros(len(begins), np.uint8)
    return Rows(np.ascontiguousarray(levels[begins]), clocks.astype(np.int64), none, none)
