# amaranth: UnusedElaboratable=no

"""Fault injection into `positioner`: its sessions, and mistakes of its resets."""

import pytest
from amaranth import Const

from tb.machines.positioner.faults import sessions, target
from tb.mistake import Mistake
from tests.machines.faults import check_sessions, resets_are_checked


def test_sessions_are_lines():
    check_sessions(sessions, b"CONNECT\n", b"\n")


TestResets = resets_are_checked(target, sessions, {
    "cuts": (Mistake("x.driver.high", reset_less=False), "a pulse of "),
    "begins": (Mistake("x.driver.ready", lambda _, at: (
        at("x.driver.idle") & ~at("x.driver.differs") & at("x.driver.enable_pin"))),
               "a reset moves "),
    "turns": (Mistake("x.driver.power", reset_less=False), "DIR or ENABLE of "),
    "keeps": (Mistake("positioning.going", reset_less=True),
              "positioning.going is not as from power-up after a reset"),
    "halts": (Mistake("positioning.halt", lambda *_: Const(1)),
              "after a reset it does not obey the question"),
}, mark=pytest.mark.long)
