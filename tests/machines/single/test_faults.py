# amaranth: UnusedElaboratable=no

"""Fault injection into `single`: its sessions, and mistakes of its resets."""

from contextlib import closing

import numpy as np
import pytest
from amaranth import Const

from tb.faults.upsets import Trial
from tb.faults.verdicts import Verdict
from tb.machines.single.faults import sessions, target
from tb.mistake import Mistake
from tests.machines.faults import check_sessions, resets_are_checked


def test_sessions_are_lines():
    check_sessions(sessions, b":v", b"\r")


TestResets = resets_are_checked(target, sessions, {
    "dumb": (Mistake("tx", lambda *_: Const(1)),
             "after a reset it does not obey the question, or does not answer it"),
    "moves": (Mistake("driver.ready", lambda _, at: (
        at("driver.enable") & (at("driver.rest") >= 0))), "a reset moves "),
    "off": (Mistake("driver.coils", reset_less=False), "the coil word of the motor is illegal"),
})


@pytest.mark.compiler
def test_upsets():
    """What is known of some by thinking: its row is where the motor stands."""
    machine = target()
    with closing(Trial(machine)) as trial:
        trial.load(machine.work(1))
        trial.work()
        verdicts, silent = trial.upsets(7, 0, 3000)
        come = {register.name: set(np.flatnonzero(row))
                for register, row in zip(trial.registers, verdicts, strict=True)}
    assert come["driver.row"] == {Verdict.SILENT}
    assert come["transmitter.word"] == come["driver.rest"] == {Verdict.HARMLESS}
    assert Verdict.VISIBLE in come["receiver.receiver_state_state"]  # shows a fault
    assert Verdict.VISIBLE in come["lines.tail"]  # a frame is refused
    assert silent and all(len(upset.place) == 1 for upset in silent)
