"""Checks of the netlist for the Spartan-3E: equivalence, unused codes, pins, unknown levels."""

from .checks import CHECKS, Check, Options, Outcome, Task

__all__ = ["CHECKS", "Check", "Options", "Outcome", "Task"]
