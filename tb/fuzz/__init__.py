"""Fuzzing of serial lines: random bytes, what may come of them, and whether it did.

What is right is said at the level of lines, from the descriptions of the machines: which line is
legal, what each is answered, and where the motors may go. Nothing here runs a model clock by clock.
"""

from .session import Outcome, fuzz, run_session, shortest
from .target import FuzzTarget
from .times import Times, measure, spread

__all__ = ["FuzzTarget", "Outcome", "Times", "fuzz", "measure", "run_session", "shortest",
           "spread"]
