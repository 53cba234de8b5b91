"""The machine of the panel, a stage of three axes. No other module here names it."""

from fresa.machines.positioner import TOP_SPEED
from fresa_host.positioner_attended import AttendedSession as StageSession
from fresa_host.positioner_lines import (
    AXES,
    MEANINGS,
    POINTS,
    STEPS_PER_UM,
    ZERO,
    Limit,
    Refusal,
    Steps,
)
from fresa_host.positioner_place import Place
from fresa_host.positioner_state import Message

from ..serve import servable

__all__ = ["AXES", "MACHINE", "MEANINGS", "POINTS", "SERVED", "STEPS_PER_UM", "TOP_SPEED", "ZERO",
           "Limit", "Message", "Place", "Refusal", "StageSession", "Steps"]

#: Its name in `tools.serve`, and what that runs.
MACHINE = "positioner"
SERVED = servable()[MACHINE]
