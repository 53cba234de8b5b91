"""What is fuzzed: a machine with a serial line, and how a session of it is checked."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..design import Design
from ..uart import BitTimingError, Levels
from .inputs import Input, LineProtocol, random_inputs
from .switches import press_switches, switch_levels
from .trajectory import Failure, Steps, TrajectoryCheck

__all__ = ["Findings", "Floods", "FuzzTarget", "Rates", "Seen"]

Seen = Mapping[str, NDArray]
"""Inputs that vary and outputs, by name: a level a clock."""

Floods = Sequence[tuple[int, int]]
"""Spans of clocks in which there were more lines than could be answered."""


@dataclass
class Findings:
    """The result of a session.

    Attributes
    ----------
    failures : list of Failure
        What is wrong, the earliest first.
    bytes, lines, answers : int
        How many were sent, legal or not; how many answers came.
    blocked : int
        Movements that a switch has ended.
    steps : int
        Steps of all motors.
    timed, deviation : int, float
        See `TrajectoryCheck`.
    """

    failures: list[Failure] = field(default_factory=list)
    bytes: int = 0
    lines: int = 0
    answers: int = 0
    blocked: int = 0
    steps: int = 0
    timed: int = 0
    deviation: float = 0.0

    def add(self, steps: Steps, check: TrajectoryCheck) -> None:
        """Add the steps of a motor and their check."""
        self.failures += check.failures
        self.steps += len(steps.clock)
        self.timed += check.timed
        self.deviation = max(self.deviation, check.deviation)


@dataclass(frozen=True)
class Rates:
    """The rates of a machine's motors.

    Attributes
    ----------
    most : int
        The highest; the least is 1.
    modulus : int
        Clocks in which there are as many steps as the rate says.
    motors : int
        How many there are, each with its own.
    begin : callable
        Gives the lines that set the rates and begin to move, all motors for long.
    """

    most: int
    modulus: int
    motors: int
    begin: Callable[[Sequence[int]], bytes]


@dataclass(frozen=True)
class FuzzTarget:
    """A machine with a serial line, its inputs ``rx`` and perhaps switches.

    Attributes
    ----------
    name : str
        What it is called.
    period : int
        Clocks of a bit.
    protocol : LineProtocol
        Its lines.
    design : callable
        Makes its design.
    outputs : tuple of str
        Outputs that `session_check` needs, and that of faults.
    session_check : callable
        Takes findings, levels of the line, what was seen at the pins, and the spans of floods; adds
        what it finds.
    fault : (str, int)
        Output that shows faults, and which bits of it.
    levels : mapping of str to int
        Constant levels of other inputs.
    switches : mapping of str to int
        Inputs with switches, and how many each has: bits of `Input.pressed`, the first ones first.
    presses : bool
        Whether switches are pressed at random, too, and not only where a sequence wants it.
    rates : Rates, optional
        If its motors have any.
    times : bool
        Whether its steps come at times that can be told from the lines.
    others : tuple of FuzzTarget
        The same machine, built in other ways: sessions take turns.
    about : str
        What is special about its sessions, in a sentence or two.
    """

    name: str
    period: int
    protocol: LineProtocol
    design: Callable[[], Design]
    outputs: tuple[str, ...]
    session_check: Callable[[Findings, Levels, Seen, Floods], None]
    fault: tuple[str, int] = ("fault", 1)
    levels: Mapping[str, int] = field(default_factory=dict)
    switches: Mapping[str, int] = field(default_factory=dict)
    presses: bool = True
    rates: Rates | None = None
    times: bool = True
    others: tuple["FuzzTarget", ...] = ()
    about: str = ""

    def inputs(self, seed: int, count: int) -> list[Input]:
        """Return what is sent in a session of so many bytes."""
        sent = random_inputs(self.protocol, seed, count, self.period)
        if self.switches and self.presses:
            sent = press_switches(sent, sum(self.switches.values()), seed, self.period)
        return [*sent]

    def stimulus(self, sent: Sequence[Input]) -> dict[str, Levels]:
        """Return the levels of the line and of the switches, by input."""
        found = {"rx": np.concatenate([item.levels for item in sent])}
        pressed = switch_levels(sent) if self.switches else np.zeros(0, np.uint16)
        for name, count in self.switches.items():
            found[name] = (pressed & (1 << count) - 1).astype(np.uint8)
            pressed = pressed >> count
        return found

    def check(self, line: Levels, seen: Seen, floods: Floods = ()) -> Findings:
        """Check a session."""
        findings, (output, bits) = Findings(), self.fault
        fault = np.flatnonzero(seen[output] & bits)
        if fault.size:
            findings.failures.append(Failure(int(fault[0]), "pins", "it shows a fault"))
        try:
            self.session_check(findings, line, seen, floods)
        except BitTimingError as error:
            findings.failures.append(Failure(error.clock, "pins", str(error)))
        findings.failures.sort()
        return findings
