"""A G-code machine in simulation: a sender at its serial line, and the steps at its pins."""

from array import array
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vcd import VCDWriter

from fresa.machines.gcode import AXES, GCodeSettings
from tb.engines import Engine

from .sender import Sender

__all__ = ["OUTPUTS", "Pins", "Simulation", "Steps", "outputs_of"]

OUTPUTS = ("tx", "step", "direction", "enable", "spindle", "reverse", "mist", "flood", "moving",
           "alarm", "fault")

OF_SECOND = ("second_step", "second_direction")
"""Those of a second motor."""


def outputs_of(settings: GCodeSettings) -> tuple[str, ...]:
    """Return the outputs of a machine that are looked at."""
    return OUTPUTS + OF_SECOND * (settings.second_axis is not None)


class Steps:
    """Steps at the pins: when each came, and where the motors were then.

    Attributes
    ----------
    clock : array of int64
        Clocks in which a pulse of STEP begins, ascending.
    change : array of int8, shape (rows, 3)
        The step of each axis in that clock: 1, -1, or 0 for none.
    """

    def __init__(self, clock: NDArray[np.int64], change: NDArray[np.int8]) -> None:
        self.clock, self.change = clock, change

    @property
    def made(self) -> list[int]:
        """How many steps each axis has made, both ways."""
        return np.abs(self.change).sum(axis=0, dtype=np.int64).tolist()

    @property
    def end(self) -> tuple[int, ...]:
        """Where the motors are at the end, in steps from where they began."""
        return tuple(self.change.sum(axis=0, dtype=np.int64).tolist())

    def positions(self) -> NDArray[np.int64]:
        """Return the position of each axis after each row."""
        return self.change.cumsum(axis=0, dtype=np.int64)


class Pins:
    """Writes a waveform of the pins, change by change.

    Parameters
    ----------
    path : path
        The file.
    settings : GCodeSettings
        Of the machine, for its clock.
    """

    def __init__(self, path: Path, settings: GCodeSettings) -> None:
        outputs = outputs_of(settings)
        self._period = 10**9 / settings.clock
        self._file = path.open("w", encoding="ascii")
        self._writer = VCDWriter(self._file, timescale="1 ns")
        names = ["rx", *(name for name in outputs if name not in ("step", "direction"))]
        self._one = {name: self._writer.register_var("gcode", name, "wire", 1, name in ("rx", "tx"))
                     for name in names}
        self._axes = {name: [self._writer.register_var("gcode", f"{name}_{axis}", "wire", 1, 0)
                             for axis in "xyz"] for name in ("step", "direction")}

    def write(self, clocks: Sequence[int], rows: dict[str, list[int]]) -> None:
        """Add changes: levels of pins by name, from clocks on."""
        for row, clock in enumerate(clocks):
            time = round(clock * self._period)
            for name, values in rows.items():
                if name in self._one:
                    self._writer.change(self._one[name], time, values[row])
                else:
                    for axis, variable in enumerate(self._axes[name]):
                        self._writer.change(variable, time, values[row] >> axis & 1)

    def close(self, clock: int) -> None:
        """End the waveform at a clock."""
        self._writer.close(round(clock * self._period))
        self._file.close()


class Simulation(Sender):
    """A machine that runs, and a session with it.

    Parameters
    ----------
    engine : Engine
        The machine, at power-up.
    settings : GCodeSettings
        What it was built with.
    pins : Pins, optional
        Where to write the waveform.

    Attributes
    ----------
    apart : int
        Steps that one motor of an axis with two has made without the other one, or another way.
    """

    def __init__(self, engine: Engine, settings: GCodeSettings, pins: Pins | None = None) -> None:
        self.apart = 0
        self._pins = pins
        self._high = self._second_high = 0
        self._clocks, self._masks = array("q"), bytearray()
        self._end = np.zeros(AXES, np.int64)
        self._idle = np.uint8(settings.store.get(2, 0))
        self._inverted = np.uint8(settings.store.get(3, 0))
        # Contacts that open when they are met are closed while nothing is met.
        closed, others = int(settings.store.get(5, 0)), int(settings.store.get(202, 0))
        second = {"second_limit": closed} if settings.second_axis is not None else {}
        super().__init__(engine, settings, outputs_of(settings),
                         limits=((1 << AXES) - 1) * closed, stop=others & 1,
                         door=others >> 1 & 1, motor_fault=others >> 2, **second)

    def end(self) -> NDArray[np.int64]:
        """Return where the motors are, in steps from where they began."""
        return self._end.copy()

    def steps(self) -> Steps:
        """Return all steps so far."""
        masks = np.frombuffer(self._masks, np.uint8)
        rises, back = masks & 7, masks >> 3
        change = np.stack([(rises >> axis & 1).astype(np.int8) * (1 - 2 * (back >> axis & 1))
                           .astype(np.int8) for axis in range(AXES)], axis=1)
        return Steps(np.frombuffer(self._clocks, np.int64), change)

    def _follow(self, clocks: NDArray[np.int64], rows: dict[str, NDArray]) -> None:
        step = rows["step"].astype(np.uint8) ^ self._idle
        rises = step & ~np.concatenate([[np.uint8(self._high)], step[:-1]])
        self._high = int(step[-1])
        where = np.flatnonzero(rises)
        ahead = rows["direction"].astype(np.uint8) ^ self._inverted
        if self._settings.second_axis is not None:
            self._compare(self._settings.second_axis, rows, rises, ahead)
        back = ~ahead[where] & rises[where]
        self._clocks.frombytes(clocks[where].tobytes())
        self._masks += (rises[where] | back << 3).tobytes()
        for axis in range(AXES):
            made = int(np.count_nonzero(rises >> axis & 1))
            self.steps_made += made
            self._end[axis] += made - 2 * np.count_nonzero(back >> axis & 1)
        if self._pins is not None:
            self._pins.write(clocks.tolist(),
                             {name: values.tolist() for name, values in rows.items()})

    def _compare(self, axis: int, rows: dict[str, NDArray], rises: NDArray, ahead: NDArray) -> None:
        """Count the steps that the motors of an axis do not make together."""
        step = rows["second_step"].astype(np.uint8) ^ (self._idle >> axis & 1)
        second = step & ~np.concatenate([[np.uint8(self._second_high)], step[:-1]])
        self._second_high = int(step[-1])
        first = rises >> axis & 1
        other = (ahead >> axis ^ rows["second_direction"] ^ self._inverted >> AXES) & 1
        self.apart += int(np.count_nonzero((first ^ second) | (first & other)))
