"""What people rely on of `positioner` is a property of its contract, or of one of its parts."""

from tb.machines.positioner import MACHINE
from tests.machines.contracts import stated

RELIED_ON = {
    "a line to the positioner is one order or one refusal; what is refused changes nothing": {
        "positioner_commands": ["one-order-a-line", "good-lines-only", "progress"],
        "positioning": ["queue-level", "queue-is-answered", "answers-in-order", "acknowledges",
                        "answers-have-a-cause", "taken-a-clock-later", "halt-ends-movements",
                        "still-unless-connected", "mot1-moves-by-order", "mot2-target", "mot3-rate",
                        "connected"]},
    "a motor of the positioner steps only by order, connected, and not towards its switch": {
        "positioner": ["{}-moves-by-order", "{}-only-connected", "{}-limit-blocks",
                       "{}-position-counts-steps", "fault-holds", "{}-pins",
                       "{}-position-is-the-pulses", "{}-waits-for-no-other", "break-halts",
                       "break-ends-steps"]},
    "a report begins at its tick, whole, with the positions of one clock": {
        "reporter": ["on-time", "first-byte-in-time", "as-ordered", "sampled-at-once",
                     "state-at-a-tick", "over-by-the-tick"],
        "positioner": ["state-is-the-machine", "seconds", "second"]},
}

TestContracts = stated(MACHINE, RELIED_ON, ["positioner_commands", "reporter"])
