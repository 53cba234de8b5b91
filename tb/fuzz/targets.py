# amaranth: UnusedElaboratable=no

"""The machines with a serial line: how they are built here, and how one looks at what they did."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fresa.machines import MillStation, Positioner, SerialOrders, Single
from fresa.machines.mill import MillTiming
from fresa.machines.positioner import LIMIT_ENDS, PositionerTiming
from fresa.machines.single import FINE, SingleTiming
from fresa.motion import ramp_rates

from .. import boards
from ..design import Design
from . import axes, limits, order_lines, orders, positioner, positioner_lines, single, single_lines
from .inputs import LineProtocol
from .line import FRAME, BitTimingError, DecodedByte, Levels, decode, decode_output
from .ramp import Ramp, check_ramp
from .trajectory import Effect, Failure, Steps, TrajectoryCheck, check_trajectory

__all__ = ["TARGETS", "Findings", "Rates", "FuzzTarget"]

Seen = Mapping[str, NDArray]
Floods = Sequence[tuple[int, int]]


@dataclass
class Findings:
    """What came of a session.

    Attributes
    ----------
    failures : list of Failure
        What must not be, the earliest first.
    lines, answers : int
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

    def add(self, steps: Steps, verdict: TrajectoryCheck) -> None:
        """Add what came of a motor."""
        self.failures += verdict.failures
        self.steps += len(steps.clock)
        self.timed += verdict.timed
        self.deviation = max(self.deviation, verdict.deviation)


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
    """A machine with a serial line.

    Attributes
    ----------
    name : str
        What it is called.
    period : int
        Clocks of a bit.
    protocol : Dialect
        How one speaks to it.
    design : callable
        Makes its design.
    outputs : tuple of str
        What is looked at.
    inspect : callable
        Looks at levels of the line, what was seen at the pins, and from when to when it was
        flooded; notes what it finds.
    levels : mapping of str to int
        Levels of the other inputs.
    rates : Rates, optional
        If its motors have any.
    others : tuple of Target
        The same machine, built in other ways.
    """

    name: str
    period: int
    protocol: LineProtocol
    design: Callable[[], Design]
    outputs: tuple[str, ...]
    inspect: Callable[[Findings, Levels, Seen, Floods], None]
    levels: Mapping[str, int] = field(default_factory=dict)
    rates: Rates | None = None
    others: tuple["FuzzTarget", ...] = ()

    def check(self, line: Levels, seen: Seen, floods: Floods = ()) -> Findings:
        """Look at a session."""
        findings = Findings()
        fault = np.flatnonzero(seen["fault"] if "fault" in seen else seen["leds"] & ERROR)
        if fault.size:
            findings.failures.append(Failure(int(fault[0]), "pins", "it shows a fault"))
        try:
            self.inspect(findings, line, seen, floods)
        except BitTimingError as broken:
            findings.failures.append(Failure(broken.clock, "pins", str(broken)))
        findings.failures.sort()
        return findings


def _ends(decoded: Sequence[DecodedByte], ends: bytes) -> list[int]:
    return [one.clock for one in decoded if one.byte in ends]


def _single(timing: SingleTiming, ramp: int = 0, top_speed: int = 1) -> FuzzTarget:
    unit, modulus = FINE * timing.rate, FINE * timing.modulus

    def check_moves(steps: Steps, effects: Sequence[Effect], clocks: int) -> TrajectoryCheck:
        if not ramp:
            return check_trajectory(steps, effects, timing.modulus, clocks, 8)
        rates = ramp_rates(acceleration=ramp, top=top_speed * unit, modulus=modulus,
                           clock=timing.clock)
        settle = timing.modulus // (single_lines.SPEEDS * timing.rate) + 4
        return check_ramp(steps, effects, Ramp(rates, modulus, unit, settle), clocks)

    def inspect(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
        steps, failures = single.motor(seen)
        decoded = list(decode(line, timing.bit))
        frames = list(single_lines.frames(iter(decoded)))
        session = single.FrameSession(decode_output(seen["tx"], timing.bit), steps, floods,
                                      _ends(decoded, single_lines.ENDS), FRAME * timing.bit)
        session.run(iter(frames))
        findings.failures += [*failures, *session.failures]
        findings.bytes, findings.lines = len(decoded), len(frames)
        findings.answers = session.answers
        if not session.failures:  # else it is not known what was asked for
            findings.add(steps, check_moves(steps, session.effects, len(line)))

    return FuzzTarget(
        "single", timing.bit, single_lines.PROTOCOL,
        lambda: boards.component("single", Single(
            timing=timing, ramp=ramp, top_speed=top_speed, greeting=single_lines.GREETING,
            help_text=single_lines.HELP)),
        ("tx", "coils", "enable", "position", "fault"), inspect,
        rates=None if ramp else Rates(single_lines.SPEEDS - 1, timing.modulus, 1,
                                      single_lines.begin))


#: With a ramp of 15 steps, from some 900 clocks each to some 100.
_RAMP = _single(SingleTiming.real(clock=240_000, baud=15_000, turn=5), 150_000, 25_000)


_POSITIONER = PositionerTiming(clock=16_000, baud=1000, top_speed=positioner_lines.TOP_SPEED,
                               width=2,
                             low=3, setup=2, hold=4, settle=30, report=40_000)


def _positioner(backlash: Sequence[int] = (0, 0, 0),
                limit_ends: Sequence[str] = LIMIT_ENDS) -> FuzzTarget:
    def inspect(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
        steps, failures = axes.load_steps(seen, backlash)
        nothing = np.zeros(len(line), np.uint8)
        switches = {end: seen["limits"] >> number & 1 for number, end in enumerate(limit_ends)}
        own = [axes.Axis(
            f"motor {number}", load, axes.Ends(switches.get(f"{name}-", nothing),
                                               switches.get(f"{name}+", nothing),
                                               _POSITIONER.settle),
            (np.flatnonzero(np.diff(seen["moving"] >> number - 1 & 1, prepend=0))).tolist())
            for number, (name, load) in enumerate(zip("XYZ", steps, strict=True), 1)]
        for one in own:
            failures += one.ends.passed(one.steps)
        decoded = list(decode(line, _BIT))
        lines = list(positioner_lines.lines(iter(decoded)))
        session = positioner.LineSession(decode_output(seen["tx"], _BIT), own, 10 * _BIT,
                                         _POSITIONER.report, len(line))
        session.run(iter(lines))
        findings.failures += [*failures, *session.failures]
        findings.bytes, findings.lines = len(decoded), len(lines)
        findings.answers = session.answers
        findings.blocked = sum(len(one.blocked) for one in own)
        if session.failures:  # it is not known what was asked for
            return
        findings.failures += session.missing_reports() + limits.check_buzzer(
            seen["buzzer"], [at for one in own for at in one.blocked],
            [at for one in own for at in one.perhaps], _POSITIONER.report)
        for one in own:
            findings.add(one.steps, check_trajectory(one.steps, one.effects, _POSITIONER.clock,
                                                     len(line), 30))

    return FuzzTarget(
        "positioner", _BIT, positioner_lines.PROTOCOL,
        lambda: boards.component("positioner", Positioner(
            timing=_POSITIONER, backlash=backlash, limit_ends=limit_ends)),
        ("tx", "step", "direction", "enable", "moving", "buzzer", "fault"), inspect,
        rates=Rates(positioner_lines.TOP_SPEED, _POSITIONER.clock, positioner_lines.AXES,
                    positioner_lines.begin))


_BIT = 16

#: LED6 of the mill.
ERROR = 1 << 6

_MILL, _TRAVEL = MillTiming(period=60, scan_bits=4), 40


def _orders(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
    steps, failures = orders.motors(seen)
    decoded = list(decode(line, _BIT))
    frames = list(single_lines.frames(iter(decoded), order_lines.ENDS, order_lines.LONGEST))
    session = orders.OrderSession(decode_output(seen["tx"], _BIT), floods,
                                  _ends(decoded, order_lines.ENDS), 10 * _BIT)
    session.run(iter(frames))
    findings.failures += [*failures, *session.failures]
    findings.bytes, findings.lines = len(decoded), len(frames)
    findings.answers = session.answers
    findings.steps = sum(len(one.clock) for one in steps)
    if not session.failures:  # else it is not known what was asked for
        findings.failures += orders.check_moves(session.accepted, steps, _MILL.period, _TRAVEL)
        findings.timed = findings.steps


TARGETS = {target.name: target for target in (
    replace(_positioner(), others=(_positioner((0, 9, 70), ("X-", "X+", "Y-")),)),
    replace(_single(SingleTiming.real(clock=48_000, baud=3000)), others=(_RAMP,)),
    FuzzTarget("mill", _BIT, order_lines.PROTOCOL,
               lambda: boards.board(
                   "mill", MillStation(source=SerialOrders(period=_BIT), timing=_MILL,
                                       z_travel=_TRAVEL), debounce=4),
               ("tx", "axis_x", "axis_y", "axis_z", "leds"), _orders, levels={"switches": 0x80}),
)}
"""What can be fuzzed, by name."""
