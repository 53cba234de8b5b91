"""The mill's model beside an engine, output by output and clock by clock."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from tb.compare import first_difference
from tb.engines import Engine
from tb.machines.mill.actions import Action, record
from tb.machines.mill.model import COILS, MillInputs, MillModel

__all__ = ["AXES", "Lockstep"]

AXES = ("axis_x", "axis_y", "axis_z")


class Lockstep:
    """An engine that runs the mill, and the model of it.

    Parameters
    ----------
    engine : Engine
        Runs the mill by its own pins. It may have run before, and is used again for every script.
    model : callable
        Makes a model of that machine, as after power-up.
    outputs : sequence of str, optional
        Outputs to compare; all without it.
    """

    def __init__(
        self, engine: Engine, model: Callable[[], MillModel], outputs: Sequence[str] | None = None
    ) -> None:
        self.engine = engine
        self.model = model
        self.outputs = list(engine.design.outputs if outputs is None else outputs)

    def apply(self, script: Iterable[Action]) -> dict[str, NDArray[np.int64]]:
        """Reset both, then play a script to both; return the outputs, clock by clock.

        Reset keeps the coils, the time since the last step, and that a start has been seen. So it
        is held, with the inputs at 0, until these times no longer matter, and the model is given
        the states of the motors.

        Raises
        ------
        AssertionError
            If an output differs; the message names the clock, the action and the outputs.
        """
        model = self.model()
        self.engine.set(**dict.fromkeys(self.engine.design.inputs, 0) | {"rst": 1})
        self.engine.run(model.period)
        model.phase = [COILS.index(self.engine.get(axis)) for axis in AXES]
        recording = record(model, script, MillInputs())
        seen = self.engine.apply(recording.stimulus, self.outputs)
        expected = {name: recording.expected[name] for name in self.outputs}
        difference = first_difference(expected, seen)
        assert difference is None, f"{difference}, in {recording.during(difference.clock)}"
        return seen
