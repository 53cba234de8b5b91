"""Serial arithmetic, and tables of formulas for it."""

from .unit import ArithmeticUnit, Operation

__all__ = ["ArithmeticUnit", "Operation"]
