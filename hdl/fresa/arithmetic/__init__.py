"""Serial arithmetic, and tables of formulas for it."""

from .arc import arc_formulas
from .formulas import Formulas, FormulaTable, Registers, Row
from .line import Line, line_formulas
from .unit import ArithmeticUnit, Operation

__all__ = ["ArithmeticUnit", "FormulaTable", "Formulas", "Line", "Operation", "Registers", "Row",
           "arc_formulas", "line_formulas"]
