"""The mill on a Nexys 2: a coil word has bit 0, YELLOW, on the lowest pin."""

from ..board import Allotment

__all__ = ["ALLOTMENT"]

ALLOTMENT = Allotment(
    header={
        "axis_x": "JA1 JA2 JA3 JA4", "axis_y": "JA7 JA8 JA9 JA10", "axis_z": "JB1 JB2 JB3 JB4",
    },
    panel={
        "switches": "jog - automatic",
        "buttons": "reset start - stop",
        "leds": "leds - busy error ready",
        "segments": "segments", "digits": "digits",
        "rx": "rx", "tx": "tx",
    },
)
