"""What people rely on of `positioner` is a property of its contract, or of one of its parts."""

import pytest

from tb.coverage import with_state_machine
from tb.machines.positioner import MACHINE
from tests.machines.contracts import check_stated

RELIED_ON = {
    "a line to the positioner is one order or one refusal; what is refused changes nothing": {
        "positioner_commands": ["one-order-a-line", "good-lines-only", "goes-on"],
        "positioning": ["counts-reasons", "reasons-are-said", "reasons-in-their-order",
                        "answers-have-a-cause", "taken-a-clock-later", "halts",
                        "still-unless-connected", "mot1-moves-by-order", "mot2-target", "mot3-rate",
                        "connected"]},
    "a motor of the positioner steps only by order, connected, and not towards its switch": {
        "positioner": ["{}-moves-by-order", "{}-is-connected", "{}-stops-at-its-limit",
                       "{}-counts-its-steps", "fault-holds", "{}-pins",
                       "{}-position-is-the-pulses", "{}-waits-for-no-other", "break-halts",
                       "break-ends-steps"]},
    "a report begins at its tick, whole, with the positions of one clock": {
        "reporter": ["on-time", "first-byte-in-time", "as-ordered", "as-it-was",
                     "over-by-the-tick"]},
}


@pytest.mark.parametrize("sentence", RELIED_ON)
def test_what_people_rely_on_is_a_property(sentence):
    check_stated(RELIED_ON[sentence])


def test_parts_with_a_state_machine_are_found():
    assert MACHINE.contracts
    found = with_state_machine()
    assert [name for name in MACHINE.contracts() if name in found] == [
        "positioner_commands", "reporter"]
