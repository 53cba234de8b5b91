"""The stimulus of `positioner`."""

import numpy as np

from tb.registry import duts
from tb.runners import ModelRunner, stimuli


def test_is_seen_at_work():
    """What is typed moves every motor, one both ways, meets a switch, and is answered."""
    machine = duts()["positioner"]
    assert machine.model is not None
    runner, up, down, answered, sounds = ModelRunner(machine.model()), 0, 0, False, False
    for block in stimuli(machine, 2, 30_000):
        seen = runner.apply(block, list(machine.shared.outputs))
        rises, way = ~seen["step"][:-1] & seen["step"][1:], seen["direction"][1:]
        up |= np.bitwise_or.reduce(rises & way)
        down |= np.bitwise_or.reduce(rises & ~way)
        answered |= not seen["tx"].all()
        sounds |= bool(seen["buzzer"].any())
    assert up | down == 7 and up & down
    assert answered and sounds
