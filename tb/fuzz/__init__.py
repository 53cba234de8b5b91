"""Anything at all on a serial line: what is sent, what may come of it, and whether it did.

What is right is said at the level of lines, from the descriptions of the machines: which line is
legal, what each is answered, and where the motors may go. Nothing here runs a model clock by clock.
"""

from .play import Outcome, fuzz, play, shortest
from .targets import TARGETS, Target
from .times import Times, measure, spread

__all__ = ["TARGETS", "Outcome", "Target", "Times", "fuzz", "measure", "play", "shortest", "spread"]
