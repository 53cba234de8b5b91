"""What people rely on of `single` is a property of its contract, or of one of its parts."""

from tb.machines.single import MACHINE
from tests.machines.contracts import stated

RELIED_ON = {
    "a frame is answered once, and a bad one changes nothing": {
        "frames": ["one-answer-per-frame", "answer-matches-frame", "target-stays", "speed-stays",
                   "power-stays"]},
    "one motor makes the steps that frames ask for and no other, whatever is on its line": {
        "single": ["step-toward-set-point", "in-time", "not-before", "no-step-without-power",
                   "coils-legal", "position-is-phase"]},
}

TestContracts = stated(MACHINE, RELIED_ON, ["frames"])
