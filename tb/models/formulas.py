"""Model of the registers of formulas: tables of the gateware, by the model of arithmetic."""

from collections.abc import Sequence

from fresa.arithmetic import FormulaTable, Line, Registers

from .arithmetic import run_table

__all__ = ["AXES", "SIZE", "FormulaModel"]

AXES = "xyz"
SIZE = 1 << 36
"""Numbers of a word."""


class FormulaModel:
    """The registers, by their names, and the tables by theirs.

    Parameters
    ----------
    registers : Registers
        Names of the registers.
    tables : sequence of FormulaTable
        Tables that can be carried out.
    line : Line
        Settings of the machine.

    Attributes
    ----------
    words : list of int
        What is in the registers, by number.
    """

    def __init__(self, registers: Registers, tables: Sequence[FormulaTable], line: Line) -> None:
        self.registers, self.line = registers, line
        self.rows = {table.name: [(row.operation.name, *row[1:]) for row in table.rows]
                     for table in tables}
        self.words = registers.image(line.values())

    def set(self, **values: int) -> None:
        """Set words by name, modulo 2**36."""
        for name, value in values.items():
            self.words[self.registers[name]] = value % SIZE

    def set_each(self, name: str, values: Sequence[int]) -> None:
        """Set the words of the three axes."""
        self.set(**{f"{name}_{axis}": value for axis, value in zip(AXES, values, strict=True)})

    def get(self, name: str) -> int:
        """Return a word."""
        return self.words[self.registers[name]]

    def signed(self, name: str) -> int:
        """Return a word that has a sign."""
        word = self.get(name)
        return word - SIZE if word >= SIZE // 2 else word

    def pair(self, name: str) -> int:
        """Return the number in two words."""
        return self.get(name) * SIZE + self.get(f"{name}.low")

    def each(self, name: str) -> list[int]:
        """Return the words of the three axes, which have signs."""
        return [self.signed(f"{name}_{axis}") for axis in AXES]

    def run(self, *names: str) -> None:
        """Carry out tables, one after the other."""
        for name in names:
            self.words = run_table(self.rows[name], self.words, width=36)
