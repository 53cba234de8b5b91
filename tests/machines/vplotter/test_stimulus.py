# amaranth: UnusedElaboratable=no

"""Random stimulus of `vplotter`: it is homed at times, and draws."""

import numpy as np
import pytest

from tb.engines import CXXRTLEngine
from tb.registry import duts
from tb.stimulus import BLOCK


@pytest.mark.compiler
@pytest.mark.long  # the machine is compiled for a minute
def test_bowed_lines_are_drawn_at_random():
    """The pen touches while nothing moves that is planned, and both strings change."""
    machine = duts()["vplotter-bowed"]
    drawn = np.zeros(2, int)
    with CXXRTLEngine(machine.design()) as engine:
        for block in range(8):
            seen = engine.apply(machine.random(1, block, BLOCK), [
                "left", "right", "pen", "moving"])
            bowed = seen["pen"][1:] & ~seen["moving"][1:] & 1
            drawn += [np.count_nonzero(bowed & (np.diff(seen[side].astype(int)) != 0))
                      for side in ("left", "right")]
    assert drawn.min() > 10
