"""The positioner on a Nexys 2.

There is no pin for one line that all switches share: it would not say which axis is to stop.
"""

from ..board import Allotment

__all__ = ["ALLOTMENT"]

ALLOTMENT = Allotment(
    header={
        "step": "JA1 JA7 JB1", "direction": "JA2 JA8 JB2", "enable": "JA3 JA9 JB3",
        "buzzer": "JB4", "limits": "JC1 JC2 JC3",
    },
    panel={
        "buttons": "reset",
        "rx": "rx", "tx": "tx",
        "leds": "moving limits fault connected",
    },
)
