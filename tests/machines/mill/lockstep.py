"""The mill's model beside an engine, output by output and clock by clock."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tb.compare import first_difference
from tb.engines import Engine
from tb.machines.mill.actions import Action, Recording, record
from tb.machines.mill.model import COILS, MillInputs, MillModel

__all__ = ["AXES", "Lockstep", "Trace"]

AXES = ("axis_x", "axis_y", "axis_z")


@dataclass(frozen=True)
class Trace:
    """What an engine was given and gave, a row a clock."""

    inputs: Mapping[str, NDArray[np.int64]]
    outputs: Mapping[str, NDArray[np.int64]]
    recording: Recording

    def __getitem__(self, name: str) -> NDArray[np.int64]:
        return (self.outputs if name in self.outputs else self.inputs)[name]

    def __len__(self) -> int:
        return len(self.recording)

    def position(self, axis: str) -> NDArray[np.int64]:
        """Steps that a motor has gone since the first row, by its coil words.

        Raises
        ------
        AssertionError
            If it is shown a word that is not in the table, or one that no motor can follow.
        """
        words = self.outputs[axis]
        phases = np.full(16, -1)
        phases[list(COILS)] = range(4)
        phase = phases[words]
        wrong = np.flatnonzero(phase < 0)
        assert not len(wrong), f"clock {wrong[0]}: {axis} is {words[wrong[0]]:04b}"
        turn = np.diff(phase) % 4
        jumps = np.flatnonzero(turn == 2)
        assert not len(jumps), f"clock {jumps[0] + 1}: {axis} jumps to {words[jumps[0] + 1]:04b}"
        return np.concatenate([[0], np.cumsum(np.where(turn == 3, -1, turn))])

    def steps(self, axis: str) -> NDArray[np.int64]:
        """Clocks in which a motor is asked to step: its word differs in the clock after."""
        return np.flatnonzero(np.diff(self.position(axis)))


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

    def apply(self, script: Iterable[Action]) -> Trace:
        """Reset both, then play a script to both.

        Reset keeps the coils, the time since the last step, and that a start has been seen. So it
        is held, with the inputs at 0, until these times no longer matter, and the model is told
        how the motors stand.

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
        inputs = {name: np.array(row, np.int64) for name, row in recording.stimulus.items()}
        return Trace(inputs, seen, recording)
