"""Machines that are struck: resets at any time, and flip-flops that change by themselves."""

from .results import Flips, Resets
from .strike import run_flips, run_resets

__all__ = ["Flips", "Resets", "run_flips", "run_resets"]
