"""What is shown of the netlist for the Spartan-3E, by ``python -m tools.netlist``."""

from .checks import CHECKS, Check, Options, Outcome, Task

__all__ = ["CHECKS", "Check", "Options", "Outcome", "Task"]
