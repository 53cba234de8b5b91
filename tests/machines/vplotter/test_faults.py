# amaranth: UnusedElaboratable=no

"""Fault injection into `vplotter`: its sessions, and mistakes of its resets."""

from contextlib import closing
from functools import partial

import pytest
from amaranth import Const

from tb.faults.upsets import Trial
from tb.machines.vplotter.faults import BOWED, BUILT, sessions, target
from tb.mistake import Mistake
from tests.machines.faults import resets_are_checked

TestResets = resets_are_checked(target, sessions, {
    "jumps": (Mistake("motor_left.driver.row", reset_less=False),
              "the coil word of the motor of the left string jumps"),
    "keeps": (Mistake("planner.outputs_last", reset_less=True),
              "planner.outputs_last is not as from power-up after a reset"),
    "locks": (Mistake("gate.locked", lambda *_: Const(1)),
              "after a reset it does not obey the question"),
}, gap=40_000, mark=pytest.mark.long)

TestResetsWithBowedLines = resets_are_checked(
    partial(target, BOWED), partial(sessions, built=BOWED), {
        "keeps": (Mistake("homing.line.most", reset_less=True),
                  "homing.line.most is not as from power-up after a reset"),
    }, gap=60_000, mark=pytest.mark.long)


@pytest.mark.compiler
@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("built", [BUILT, BOWED], ids=["straight", "bowed"])
def test_the_machine_counts_what_its_motors_make(built, seed):
    machine = target(built)
    with closing(Trial(machine)) as trial:
        trial.load(machine.work(seed))
        assert trial.work() > 100_000
