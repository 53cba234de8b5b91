"""Comparison of outputs, clock by clock."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["Difference", "first_difference"]


@dataclass(frozen=True)
class Difference:
    """The first clock in which two sets of outputs differ, and the differing outputs."""

    clock: int
    outputs: dict[str, tuple[int, int]]  # expected, seen

    def __str__(self) -> str:
        values = ", ".join(
            f"{name} is {seen:#x}, not {expected:#x}"
            for name, (expected, seen) in self.outputs.items()
        )
        return f"clock {self.clock}: {values}"


def first_difference(
    expected: Mapping[str, ArrayLike], seen: Mapping[str, ArrayLike]
) -> Difference | None:
    """Compare outputs, one row per clock. `seen` must contain all expected outputs."""
    rows = {name: (np.asarray(row), np.asarray(seen[name])) for name, row in expected.items()}
    clocks = [int(np.argmax(a != b)) for a, b in rows.values() if (a != b).any()]
    if not clocks:
        return None
    clock = min(clocks)
    return Difference(
        clock,
        {
            name: (int(a[clock]), int(b[clock]))
            for name, (a, b) in rows.items()
            if a[clock] != b[clock]
        },
    )
