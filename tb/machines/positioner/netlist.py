"""What of `positioner` is checked as a netlist."""

from fresa.machines import Positioner
from tb.netlist.serial import serial_part

from . import MACHINE

__all__ = ["NETLIST"]

NETLIST = serial_part(MACHINE.dut("positioner"), Positioner)
