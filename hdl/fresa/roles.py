"""What the ports of a machine are for: the data by which a board wires it.

A role says what a port needs to be a pin, whatever the board. Which pin that is, and at which level
the parts of a board are on, is data of the board; the level of what is wired to a header is the
role's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from amaranth.lib import wiring

__all__ = ["BUTTON", "BUZZER", "COILS", "COOLANT", "DIGITS", "DIRECTION", "DOOR", "ENABLE",
           "LIMIT", "MOTOR_FAULT", "NUMBER", "PEN", "PROBE", "RX", "SEGMENTS", "SERVO", "SPINDLE",
           "STATUS", "STEP", "STOP", "SWITCH", "TX", "MachineComponent", "Role"]


@dataclass(frozen=True)
class Role:
    """What a port is for.

    Attributes
    ----------
    name : str
        The name shown to people.
    rest : int
        Level of the port at power-up and at rest.
    registered : bool
        An output that comes from a flip-flop in the I/O block, with the level of rest at power-up.
    bounces : bool
        An input that needs a debouncer.
    to_ground : bool
        A contact that is wired to ground where it is on a header: its pin is pulled up, and low
        where the contact is closed.
    active_low : bool
        The port of the machine is on where it is 0, whatever the level of its pin.
    optional : bool
        A board may leave it without a pin.
    """

    name: str
    rest: int = 0
    registered: bool = False
    bounces: bool = False
    to_ground: bool = False
    active_low: bool = False
    optional: bool = False

    def resting(self, level: int) -> "Role":
        """Return this role with another level at rest."""
        return replace(self, rest=level)


STEP = Role("STEP", registered=True)
DIRECTION = Role("DIR", registered=True)
ENABLE = Role("ENABLE", registered=True)
COILS = Role("coils", registered=True)
SPINDLE = Role("spindle", registered=True, optional=True)
PEN = Role("pen", registered=True)
SERVO = Role("servo", registered=True, optional=True)
COOLANT = Role("coolant", registered=True, optional=True)
BUZZER = Role("buzzer", registered=True, optional=True)
LIMIT = Role("limit switch", to_ground=True)
DOOR = Role("door switch", to_ground=True, optional=True)
PROBE = Role("probe", to_ground=True, optional=True)
MOTOR_FAULT = Role("fault of a driver", to_ground=True, optional=True)
"""An output of driver modules that is pulled to ground, such as nFAULT."""
RX = Role("UART, to the FPGA", rest=1)
TX = Role("UART, from the FPGA", rest=1, registered=True)
SWITCH = Role("switch", bounces=True, to_ground=True)
BUTTON = Role("button", bounces=True, to_ground=True)
STOP = Role("stop button", to_ground=True)
"""A button that the machine itself filters and latches, so that it acts sooner than a debouncer."""
STATUS = Role("LED", optional=True)
"""Levels that people may see; a machine has them for LEDs and for tests."""
NUMBER = Role("number on the display", optional=True)
"""A number that a board shows on its display, if it has one."""
SEGMENTS = Role("display, segments a to g and point", rest=0xFF, active_low=True, optional=True)
DIGITS = Role("display, digits", rest=0xF, active_low=True, optional=True)
"""The display of a machine that scans it itself."""


class MachineComponent(wiring.Component):
    """A machine whose ports have roles, so that a board can be wired to it.

    Attributes
    ----------
    roles : mapping of str to Role
        The role of each port.
    """

    roles: Mapping[str, Role]
