"""The registers of the formulas, which tables are carried out on: on an engine."""

from collections.abc import Sequence

from fresa.arithmetic import FormulaTable
from tb.engines import Engine


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
