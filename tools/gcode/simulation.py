"""A G-code machine in simulation: a sender at its serial line, and the steps at its pins.

Time goes by in slices, at whose ends the sender takes what the machine has sent. So an answer is
read up to a slice late, as by a computer behind USB.
"""

from array import array
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from vcd import VCDWriter

from fresa.machines.gcode import AXES, GCodeSettings
from fresa_host.gcode_lines import RESUME
from fresa_host.gcode_session import GCodeSession
from fresa_host.session import Waiting
from tb.engines import Engine
from tb.uart import FRAME, Decoder, levels

__all__ = ["OUTPUTS", "Pins", "Simulation", "Steps", "outputs_of"]

T = TypeVar("T")

OUTPUTS = ("tx", "step", "direction", "enable", "spindle", "reverse", "mist", "flood", "moving",
           "alarm", "fault")

OF_SECOND = ("second_step", "second_direction")
"""Those of a second motor."""

SLICE_S = 0.002
"""Seconds of the machine in a slice."""

QUIET_S = 0.02
"""Seconds without a movement after which none is to come: a line is planned in much less."""

POLL_S = 0.2
"""Seconds between two requests for status while it moves and no answer is awaited."""


def outputs_of(settings: GCodeSettings) -> tuple[str, ...]:
    """Return the outputs of a machine that are looked at."""
    return OUTPUTS + OF_SECOND * (settings.second_axis is not None)


class Steps:
    """Steps at the pins: when each came, and where the motors were then.

    Attributes
    ----------
    clock : array of int64
        Clocks with a rising edge of STEP, ascending.
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


class Simulation:
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
    session : GCodeSession
        The sender.
    engine : Engine
        The machine.
    steps_made : int
        Steps at the pins so far.
    pauses : int
        How often it was started again after M0.
    apart : int
        Steps that one motor of an axis with two has made without the other one, or another way.
    """

    def __init__(self, engine: Engine, settings: GCodeSettings, pins: Pins | None = None) -> None:
        self.engine = engine
        self.session = GCodeSession(name="the simulation", baud=settings.line_baud)
        self.steps_made = self.pauses = self.apart = 0
        self._settings, self._pins = settings, pins
        self._bit = settings.bit
        self._slice = round(SLICE_S * settings.clock)
        self._decoder = Decoder(self._bit)
        self._waiting = b""
        self._high = self._second_high = self._reports = 0
        self._outputs = outputs_of(settings)
        self._clocks, self._masks = array("q"), bytearray()
        self._end = np.zeros(AXES, np.int64)
        self._inverted = np.uint8(settings.store.get(3, 0))
        # Switches that open when they are met are closed while nothing is met.
        closed = int(settings.store.get(5, 0))
        engine.set(rx=1, limits=((1 << AXES) - 1) * closed)
        if settings.second_axis is not None:
            engine.set(second_limit=closed)
        self._run(10 * FRAME * self._bit)

    @property
    def seconds(self) -> float:
        """Time of the machine since power-up."""
        return self.engine.clock / self._settings.clock

    def do(self, steps: Waiting[T], progress: Callable[[int], None] = lambda made: None) -> T:
        """Carry out an operation of the session; a pause of the program is ended at once.

        Parameters
        ----------
        steps : generator
            The operation.
        progress : callable
            Called repeatedly with the steps made since the last call.
        """
        operation = self.session.begin(steps, self.seconds)
        while not operation.done:
            self._advance(progress)
        return operation.result()

    def finish(self, progress: Callable[[int], None] = lambda made: None) -> float:
        """Wait until nothing moves; return when the last movement ended, in seconds."""
        end, poll = self.seconds, self.seconds + POLL_S
        while self.seconds - end < QUIET_S:
            if self.seconds >= poll:
                self.do(self.session.report(), progress)
                poll = self.seconds + POLL_S
            self._advance(progress)
            if self.engine.get("moving"):
                end = self.seconds
        return end

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

    def _advance(self, progress: Callable[[int], None]) -> None:
        """Make a slice, and give the session what has come."""
        session, before = self.session, self.steps_made
        data = self._waiting + b"".join(output.data for output in session.take_outputs())
        count = max(1, self._slice // (FRAME * self._bit))
        self._waiting = data[count:]
        received = self._send(data[:count]) if data else self._run(self._slice)
        session.receive(received, self.seconds)
        session.tick(self.seconds)
        if session.reports != self._reports:
            self._reports = session.reports
            if session.status is not None and session.status.state == "Hold":
                self._waiting += RESUME
                self.pauses += 1
        progress(self.steps_made - before)

    def _run(self, clocks: int) -> bytes:
        # What `_send` has seen is no run, so that a run does not go on from there.
        start, before = self.engine.clock, self.engine.get(*self._outputs)
        changes = self.engine.run(clocks, self._outputs)
        return self._take(np.concatenate([[start], changes.clock]), {
            name: np.concatenate([[level], changes[name]])
            for name, level in zip(self._outputs, before, strict=True)})

    def _send(self, data: bytes) -> bytes:
        """Put bytes on the line; return those that came meanwhile."""
        line, start = levels(data, self._bit), self.engine.clock
        rows = self.engine.apply({"rx": line}, self._outputs)
        changed = np.zeros(len(line), bool)
        changed[0] = True
        for values in (*rows.values(), line):
            changed[1:] |= values[1:] != values[:-1]
        where = np.flatnonzero(changed)
        rows["rx"] = line
        return self._take(start + where, {name: values[where] for name, values in rows.items()})

    def _take(self, clocks: NDArray[np.int64], rows: dict[str, NDArray]) -> bytes:
        """Take changes of the pins; return the bytes that came."""
        received = [self._decoder.feed(clock, level) for clock, level in zip(
            clocks.tolist(), rows["tx"].tolist(), strict=True)]
        received.append(self._decoder.feed(self.engine.clock, self.engine.get("tx")))
        step = rows["step"].astype(np.uint8)
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
        if rows["fault"].any():
            raise RuntimeError(f"the machine shows a fault at clock {self.engine.clock}")
        if self._pins is not None:
            self._pins.write(clocks.tolist(),
                             {name: values.tolist() for name, values in rows.items()})
        return b"".join(received)

    def _compare(self, axis: int, rows: dict[str, NDArray], rises: NDArray, ahead: NDArray) -> None:
        """Count the steps that the motors of an axis do not make together."""
        step = rows["second_step"].astype(np.uint8)
        second = step & ~np.concatenate([[np.uint8(self._second_high)], step[:-1]])
        self._second_high = int(step[-1])
        first = rises >> axis & 1
        other = (ahead >> axis ^ rows["second_direction"] ^ self._inverted >> AXES) & 1
        self.apart += int(np.count_nonzero((first ^ second) | (first & other)))
