"""What the line of the mill is fuzzed with, its orders, and how a session is checked.

What is right is stated here once more, from the description of the machine: nothing is imported
from its model or its gateware but the machine itself.
"""

from fresa.machines import MillStation, SerialOrders
from fresa.machines.mill import MillTiming
from tb import boards
from tb.fuzz.target import Findings, Floods, FuzzTarget, Seen
from tb.uart import FRAME, Levels, decode, decode_output

from .lines import ENDS, PROTOCOL, frames
from .session import OrderSession, check_moves, motors

__all__ = ["FUZZ"]

BIT, PERIOD, TRAVEL = 16, 60, 40
"""Clocks of a bit and of a step, and steps of Z."""


def _check(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
    steps, failures = motors(seen)
    received = list(decode(line, BIT))
    given = list(frames(iter(received)))
    session = OrderSession(decode_output(seen["tx"], BIT), floods,
                           [one.clock for one in received if one.byte in ENDS], FRAME * BIT)
    session.run(given)
    findings.failures += [*failures, *session.failures]
    findings.bytes, findings.lines = len(received), len(given)
    findings.answers = session.answers
    findings.steps = sum(len(one.clock) for one in steps)
    if not session.failures:  # else it is not known what was asked for
        findings.failures += check_moves(session.accepted, steps, PERIOD, TRAVEL)
        findings.timed = findings.steps


FUZZ = FuzzTarget(
    "mill", BIT, PROTOCOL,
    lambda: boards.board(
        "mill", MillStation(source=SerialOrders(period=BIT), z_travel=TRAVEL,
                            timing=MillTiming(period=PERIOD, scan_bits=4)), debounce=4),
    ("tx", "axis_x", "axis_y", "axis_z", "leds"), _check,
    fault=("leds", 1 << 6), levels={"switches": 1 << 7},
    about="A Nexys 2 that is given orders over the line. In a flood lines may be lost.")
"""The Nexys 2 with orders over the line, in automatic mode; LED6 shows faults."""
