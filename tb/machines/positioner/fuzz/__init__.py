"""What the line of `positioner` is fuzzed with, and how a session is checked.

What is right is stated here once more, from the description of the machine: nothing is imported
from its model or its gateware but the machine itself.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fresa.machines.positioner import Positioner, PositionerTiming
from tb import boards
from tb.fuzz.target import Findings, Floods, FuzzTarget, Rates, Seen
from tb.fuzz.trajectory import check_trajectory
from tb.uart import FRAME, Levels, decode, decode_output

from .axes import Axis, Ends, load_steps
from .limits import check_buzzer
from .lines import AXES, PROTOCOL, TOP_SPEED, begin, split_lines
from .session import LineSession

__all__ = ["FUZZ"]

BIT = 16
SETTLE, REPORT = 30, 40_000
TIMING = PositionerTiming(clock=1000 * BIT, baud=1000, top_speed=TOP_SPEED, width=2, low=3, setup=2,
                          hold=4, settle=SETTLE, report=REPORT)


def _target(backlash: Sequence[int], limit_ends: Sequence[str]) -> FuzzTarget:
    def check(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
        steps, failures = load_steps(seen, backlash)
        released = np.zeros(len(line), np.uint8)
        switches = {end: seen["limits"] >> number & 1 for number, end in enumerate(limit_ends)}
        own = [Axis(f"motor {number}", load,
                    Ends(switches.get(f"{name}-", released), switches.get(f"{name}+", released),
                         SETTLE),
                    np.flatnonzero(np.diff(seen["moving"] >> number - 1 & 1, prepend=0)).tolist())
               for number, (name, load) in enumerate(zip("XYZ", steps, strict=True), 1)]
        for one in own:
            failures += one.ends.passed(one.steps)
        received = list(decode(line, BIT))
        given = list(split_lines(iter(received)))
        session = LineSession(decode_output(seen["tx"], BIT), own, seen, byte=FRAME * BIT,
                              report=REPORT, second=TIMING.clock, clocks=len(line))
        session.run(iter(given))
        findings.failures += [*failures, *session.failures]
        findings.bytes, findings.lines = len(received), len(given)
        findings.answers = session.answers
        findings.blocked = sum(len(one.blocked) for one in own)
        if session.failures:  # it is not known what was requested
            return
        findings.failures += session.missing_reports() + check_buzzer(
            seen["buzzer"], [at for one in own for at in one.blocked],
            [at for one in own for at in one.perhaps], REPORT)
        for one in own:
            findings.add(one.steps, check_trajectory(one.steps, one.effects, TIMING.clock,
                                                     len(line), 30))

    return FuzzTarget(
        "positioner", BIT, PROTOCOL,
        lambda: boards.component("positioner", Positioner(
            timing=TIMING, backlash=backlash, limit_ends=limit_ends)),
        ("tx", "step", "direction", "enable", "moving", "buzzer", "fault"), check,
        switches={"limits": AXES}, rates=Rates(TOP_SPEED, TIMING.clock, AXES, begin))


FUZZ = replace(_target((0, 0, 0), ("X+", "Y+", "Z+")),
                 others=(_target((0, 9, 70), ("X-", "X+", "Y-")),),
                 about="Every other session is with backlash in two axes, and limit switches at "
                       "other ends. It is flooded with lines of all kinds and obeys each; how many "
                       "answers wait, and which of them give way to one OVERFLOW, is checked.")
"""The machine, and with backlash in two axes and its limit switches at other ends."""
