"""Contracts of the positioner, of its commands and of its reports."""

from .commands import POSITIONER_COMMANDS
from .machine import POSITIONER
from .positioning import POSITIONING
from .reporter import REPORTER

__all__ = ["CONTRACTS"]

CONTRACTS = {"positioner_commands": POSITIONER_COMMANDS, "positioning": POSITIONING,
             "reporter": REPORTER, "positioner": POSITIONER}
