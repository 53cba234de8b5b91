# amaranth: UnusedElaboratable=no

"""Fault injection into `gcode`: its sessions, and mistakes of its resets."""

import pytest
from amaranth import Const

from tb.machines.gcode.faults import sessions, target
from tb.mistake import Mistake
from tests.machines.faults import check_sessions, resets_are_checked


def test_sessions_are_lines():
    check_sessions(sessions, b"G91F9000\n", b"\n")


TestResets = resets_are_checked(target, sessions, {
    "takes power": (Mistake("enable", lambda _, at: (
        at("driver_x.enable_pin") & at("driver_y.enable_pin") & at("driver_z.enable_pin"))),
                    "DIR or ENABLE of "),
    "keeps": (Mistake("planner.outputs_last", reset_less=True),
              "planner.outputs_last is not as from power-up after a reset"),
    "locks": (Mistake("gate.locked", lambda *_: Const(1)),
              "after a reset it does not obey the question"),
}, gap=25_000, mark=pytest.mark.long)
