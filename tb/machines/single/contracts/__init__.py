"""Contracts of `single` and of what reads its frames."""

from .frames import FRAMES
from .machine import SINGLE

__all__ = ["CONTRACTS"]

CONTRACTS = {"frames": FRAMES, "single": SINGLE}
