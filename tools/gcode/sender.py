"""A machine that speaks G-code, in simulation, with a sender at its serial line.

Time goes by in slices, at whose ends the sender takes what the machine has sent. So an answer is
read up to a slice late, as by a computer behind USB.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fresa.machines.gcode import GCodeSettings
from fresa_host.gcode_lines import RESUME
from fresa_host.gcode_session import GCodeSession
from fresa_host.session import Waiting
from tb.engines import Engine
from tb.uart import FRAME, Decoder, levels

__all__ = ["FaultShown", "Sender"]

T = TypeVar("T")

SLICE_S = 0.002
"""Seconds of the machine in a slice."""

QUIET_S = 0.02
"""Seconds without a movement after which none is to come: a line is planned in much less."""

POLL_S = 0.2
"""Seconds between two requests for status while it moves and no answer is awaited."""


class FaultShown(RuntimeError):
    """The machine shows a fault of its own at its pins."""


class Sender(ABC):
    """A machine that runs, and a session with it.

    Parameters
    ----------
    engine : Engine
        The machine, at power-up.
    settings : GCodeSettings
        What it was built with.
    outputs : sequence of str
        Outputs that are looked at: ``tx``, ``moving``, ``fault``, and those of `_follow`.
    inputs : int
        Levels of inputs, by their names; that of the line is high anyway.

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
    """

    def __init__(self, engine: Engine, settings: GCodeSettings, outputs: Sequence[str],
                 **inputs: int) -> None:
        self.engine = engine
        self.session = GCodeSession(name="the simulation", baud=settings.line_baud)
        self.steps_made = self.pauses = 0
        self._settings, self._outputs = settings, tuple(outputs)
        self._bit = settings.bit
        self._slice = round(SLICE_S * settings.clock)
        self._decoder = Decoder(self._bit)
        self._waiting = b""
        self._reports = 0
        engine.set(rx=1, **inputs)
        self._run(10 * FRAME * self._bit)

    @abstractmethod
    def _follow(self, clocks: NDArray[np.int64], rows: dict[str, NDArray]) -> None:
        """Follow the outputs from clocks on; `steps_made` goes up by the steps among them."""

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
        tx = rows["tx"]
        where = np.flatnonzero(np.concatenate([[True], tx[1:] != tx[:-1]]))
        received = [self._decoder.feed(clock, level) for clock, level in zip(
            clocks[where].tolist(), tx[where].tolist(), strict=True)]
        received.append(self._decoder.feed(self.engine.clock, self.engine.get("tx")))
        self._follow(clocks, rows)
        if rows["fault"].any():
            raise FaultShown(f"the machine shows a fault at clock {self.engine.clock}")
        return b"".join(received)
