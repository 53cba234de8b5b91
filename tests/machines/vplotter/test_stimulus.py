# amaranth: UnusedElaboratable=no

"""Random stimulus of `vplotter`: it homes and draws."""

from collections.abc import Iterator, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from tb.engines import CXXRTLEngine
from tb.registry import duts
from tb.stimulus import BLOCK

PINS = ["left", "right", "pen", "moving"]


def bowed(seen: Mapping[str, NDArray]) -> Iterator[tuple[int, int]]:
    """Give the steps of both strings while the pen touches and nothing is planned, each time."""
    edges = np.flatnonzero(np.diff(seen["pen"].astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if not seen["moving"][begin - 1:end].any():
            left, right = (int(np.count_nonzero(np.diff(seen[side][begin:end])))
                           for side in ("left", "right"))
            yield left, right


@pytest.mark.compiler
@pytest.mark.long  # the machine is compiled for a minute
def test_bowed_lines_are_drawn_at_random():
    machine = duts()["vplotter-bowed"]
    with CXXRTLEngine(machine.design()) as engine:
        blocks = [engine.apply(machine.random(1, block, BLOCK), PINS) for block in range(24)]
    drawn = [*bowed({name: np.concatenate([seen[name] for seen in blocks]) for name in PINS})]
    assert sum(max(steps) >= 8 for steps in drawn) >= 2
