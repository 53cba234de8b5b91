"""`single` on a Nexys 2."""

from ..board import Allotment

__all__ = ["ALLOTMENT"]

ALLOTMENT = Allotment(
    header={"coils": "JA1 JA2 JA3 JA4", "enable": "JA7"},
    panel={
        "buttons": "reset",
        "rx": "rx", "tx": "tx",
        "leds": "coils - moving fault enable",
        "segments": "segments", "digits": "digits",
    },
    number="position",
)
