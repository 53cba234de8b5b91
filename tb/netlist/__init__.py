"""Checks of the netlist for the Spartan-3E: equivalence, unused codes, pins, unknown levels."""

from .checks import CHECKS, Check, Options, Outcome, Task
from .part import BuiltPins, NetlistPart

__all__ = ["CHECKS", "BuiltPins", "Check", "NetlistPart", "Options", "Outcome", "Task"]
