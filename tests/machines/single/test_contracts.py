"""What people rely on of `single` is a property of its contract, or of one of its parts."""

import pytest

from tb.coverage import with_state_machine
from tb.machines.single import MACHINE
from tests.machines.contracts import check_stated

RELIED_ON = {
    "a frame is answered once, and a bad one changes nothing": {
        "frames": ["one-answer", "answers-what-it-is", "target-stays", "speed-stays",
                   "power-stays"]},
    "one motor makes the steps that frames ask for and no other, whatever is on its line": {
        "single": ["steps-as-asked", "in-time", "not-before", "no-step-without-power",
                   "coils-legal", "position-is-phase"]},
}


@pytest.mark.parametrize("sentence", RELIED_ON)
def test_what_people_rely_on_is_a_property(sentence):
    check_stated(RELIED_ON[sentence])


def test_parts_with_a_state_machine_are_found():
    assert MACHINE.contracts
    found = with_state_machine()
    assert [name for name in MACHINE.contracts() if name in found] == ["frames"]
