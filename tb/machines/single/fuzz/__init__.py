"""What the line of `single` is fuzzed with, and how a session is checked.

What is right is stated here once more, from the description of the machine: nothing is imported
from its model or its gateware but the machine itself.
"""

from dataclasses import replace
from math import sqrt

from fresa.machines.single import Single, SingleTiming
from tb import boards
from tb.fuzz.ramp import Ramp, check_ramp
from tb.fuzz.target import Findings, Floods, FuzzTarget, Rates, Seen
from tb.fuzz.trajectory import TrajectoryCheck, check_trajectory
from tb.uart import FRAME, Levels, decode, decode_output

from .lines import ENDS, GREETING, HELP, PROTOCOL, SPEEDS, begin, frames
from .session import FrameSession, motor

__all__ = ["FUZZ"]

FINE = 16
"""With a ramp, rates are counted in so many parts of an rpm."""


def _target(*, clock: int, baud: int, turn: int, ramp: int = 0, top_speed: int = 1) -> FuzzTarget:
    """Make the target: `turn` steps a turn; `ramp` in steps/s², up to `top_speed` in rpm."""
    step, bit = 60 * clock // turn, clock // baud  # clocks of a step at 1 rpm, and of a bit

    def check_motor(session: FrameSession, clocks: int) -> TrajectoryCheck:
        if not ramp:
            return check_trajectory(session.steps, session.effects, step, clocks, 8)
        rates = _rates(ramp, top_speed * FINE, FINE * step, clock)
        return check_ramp(session.steps, session.effects,
                          Ramp(rates, FINE * step, FINE, step // SPEEDS + 4), clocks)

    def check(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
        steps, failures = motor(seen)
        received = list(decode(line, bit))
        given = list(frames(iter(received)))
        session = FrameSession(decode_output(seen["tx"], bit), floods,
                               [one.clock for one in received if one.byte in ENDS], FRAME * bit,
                               steps)
        session.run(given)
        findings.failures += [*failures, *session.failures]
        findings.bytes, findings.lines = len(received), len(given)
        findings.answers = session.answers
        if not session.failures:  # else it is not known what was requested
            findings.add(steps, check_motor(session, len(line)))

    timing = SingleTiming.real(clock=clock, baud=baud, turn=turn)
    return FuzzTarget(
        "single", bit, PROTOCOL,
        lambda: boards.component("single", Single(
            timing=timing, ramp=ramp, top_speed=top_speed, greeting=GREETING, help_text=HELP)),
        ("tx", "coils", "enable", "position", "fault"), check,
        rates=None if ramp else Rates(SPEEDS - 1, step, 1, begin))


def _rates(acceleration: int, top: int, modulus: int, clock: int) -> list[int]:
    """Return the rates of a constant acceleration in steps/s², step by step from standstill.

    After n steps v = sqrt(2 a n); the rate of a step is the mean of the speeds before and after.
    """
    rates: list[int] = []
    while not rates or rates[-1] < top:
        before, after = (sqrt(2 * acceleration * n) for n in (len(rates), len(rates) + 1))
        rates.append(min(top, int((before + after) / 2 * modulus / clock)))
    return rates


FUZZ = replace(_target(clock=48_000, baud=3000, turn=48), others=(
    # With a ramp of 15 steps, from some 900 clocks each to some 100.
    _target(clock=240_000, baud=15_000, turn=5, ramp=150_000, top_speed=25_000),),
    about="Every other session is with a ramp: the rate of each step is then that of its place on "
          "the ramp. In a flood frames may be lost.")
"""The machine, and with a ramp."""
