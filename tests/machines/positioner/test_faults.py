# amaranth: UnusedElaboratable=no

"""Fault injection into `positioner`: its sessions, and mistakes of its resets."""

import pytest
from amaranth import Const

from tb.machines.positioner.faults import sessions, target
from tb.mistake import Mistake
from tests.machines.faults import check_resets, check_sessions, run_with_fault


def test_sessions_are_lines():
    check_sessions(sessions, b"CONNECT\n", b"\n")


@pytest.mark.compiler
class TestResets:
    @pytest.mark.parametrize(("mistake", "found"), [
        (Mistake("x.driver.ready", lambda _, at: (
            at("x.driver.over") & ~at("x.driver.step_pin") & at("x.driver.right")
            & at("x.driver.enable_pin"))), "a reset moves "),
        (Mistake("x.driver.high", reset_less=False), "a pulse of "),
        (Mistake("x.driver.power", reset_less=False), "DIR or ENABLE of "),
        (Mistake("positioning.going", reset_less=True),
         "positioning.going is not as from power-up after a reset"),
        (Mistake("positioning.halt", lambda *_: Const(1)),
         "after a reset it does not do what it is asked"),
    ], ids=["begins", "cuts", "turns", "keeps", "halts"])
    def test_mistakes_are_found(self, mistake, found):
        _, wrong = run_with_fault(mistake, target, sessions(1), 9000)
        assert wrong is not None and wrong.what.startswith(found)

    def test_none_without_a_mistake(self):
        check_resets(target, sessions)
