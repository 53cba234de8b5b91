# amaranth: UnusedElaboratable=no

"""The stimulus of `gcode`: what it leads a machine with a second motor to."""

import numpy as np
import pytest

from tb.engines import CXXRTLEngine
from tb.registry import duts


@pytest.mark.compiler
@pytest.mark.long  # it is compiled for this alone
def test_one_motor_of_two_is_homed_without_the_other_where_it_is_sought_and_located():
    machine = duts()["gcode-gantry"]
    design = machine.design()
    with CXXRTLEngine(design) as engine:
        seen = engine.apply(machine.directed(1, 50_000), ["step", "second_step", "alarm"])
    first, second = seen["step"] >> 2 & 1, seen["second_step"]
    alone = np.flatnonzero(np.diff((first ^ second).astype(np.int8), prepend=0) == 1)
    assert second[alone].tolist() == sorted(second[alone], reverse=True)  # either has its turn
    assert set(second[alone].tolist()) == {0, 1} and not seen["alarm"].any()


@pytest.mark.long
def test_either_build_has_a_column_for_every_input():
    for name in ("gcode", "gcode-gantry"):
        machine = duts()[name]
        for rows in (machine.directed(1, 2000), machine.random(1, 0, 200)):
            assert set(rows) == {"rst", *machine.shared.inputs}
