"""Fault injection: resets at any time, and bit upsets of flip-flops."""

from .inject import run_resets, run_upsets
from .results import Resets, Upsets

__all__ = ["Upsets", "Resets", "run_upsets", "run_resets"]
