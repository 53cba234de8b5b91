"""The registers of the formulas, which tables are carried out on: in Python, and on an engine."""

from collections.abc import Sequence

from fresa.arithmetic import FormulaTable, Line, Registers
from tb.engines import Engine
from tb.models.arithmetic import run_table

AXES = "xyz"
SIZE = 1 << 36


class FormulaModel:
    """The registers, by their names, and the tables by theirs."""

    def __init__(self, registers: Registers, tables: Sequence[FormulaTable], line: Line) -> None:
        self.registers, self.line = registers, line
        self.rows = {table.name: [(row.operation.name, *row[1:]) for row in table.rows]
                     for table in tables}
        self.words = registers.image(line.values())

    def set(self, **values: int) -> None:
        for name, value in values.items():
            self.words[self.registers[name]] = value % SIZE

    def set_each(self, name: str, values: Sequence[int]) -> None:
        self.set(**{f"{name}_{axis}": value for axis, value in zip(AXES, values, strict=True)})

    def get(self, name: str) -> int:
        return self.words[self.registers[name]]

    def signed(self, name: str) -> int:
        word = self.get(name)
        return word - SIZE if word >= SIZE // 2 else word

    def pair(self, name: str) -> int:
        return self.get(name) * SIZE + self.get(f"{name}.low")

    def each(self, name: str) -> list[int]:
        return [self.signed(f"{name}_{axis}") for axis in AXES]

    def run(self, *names: str) -> None:
        """Carry out tables."""
        for name in names:
            self.words = run_table(self.rows[name], self.words, width=36)


class FormulaGateware:
    """The formulas on an engine."""

    def __init__(self, engine: Engine, tables: Sequence[FormulaTable]) -> None:
        self.engine = engine
        self.clocks = {table.name: (number, table.clocks(36))
                       for number, table in enumerate(tables)}
        engine.run(1)

    def run(self, words: Sequence[int], *names: str) -> list[int]:
        """Carry out tables on these registers; check that they take their clocks."""
        engine = self.engine
        for address, word in enumerate(words):
            engine.set(address=address, write=1, value=word)
            engine.run(1)
        engine.set(write=0)
        for name in names:
            number, clocks = self.clocks[name]
            engine.set(start=1, table=number)
            engine.run(1)
            engine.set(start=0)
            engine.run(clocks - 2)
            assert engine.get("busy", "done") == (1, 0)
            engine.run(1)
            assert engine.get("busy", "done") == (0, 1)
        seen = []
        for address in range(len(words)):
            engine.set(address=address)
            engine.run(2)
            seen.append(engine.get("word"))
        return seen
