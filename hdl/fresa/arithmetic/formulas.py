"""Tables of formulas, carried out by the arithmetic unit on a memory of registers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from amaranth import Module, Mux, Signal, unsigned
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import look_up
from ..fsm import leave_unused_codes
from .unit import ArithmeticUnit, Operation

__all__ = ["FormulaTable", "Formulas", "Registers", "Row"]

MAX_ROWS = 2048
"""Most rows of all tables together."""

ALIGNMENT = 32
"""Each table begins at a multiple of this: so few bits of that are to be looked up."""

SLICE = 9
"""Bits of a row in one memory."""


class Row(NamedTuple):
    """An operation on registers, by their numbers.

    The low word of the pair [a], and the place of a second word, is the register whose number
    differs in the lowest bit.
    """

    operation: Operation
    a: int
    b: int
    destination: int


class Registers:
    """Numbers of registers by name, and what is in them at first.

    Parameters
    ----------
    depth : int
        Number of registers.
    """

    def __init__(self, depth: int = 128) -> None:
        self.depth = depth
        self.numbers: dict[str, int] = {}
        self.init: dict[str, int] = {}
        self._next = 0

    def __getitem__(self, name: str) -> int:
        return self.numbers[name]

    def word(self, *names: str, init: int = 0) -> None:
        """Give a register to each name."""
        for name in names:
            self._add(name, self._next)
            self.init[name] = init
            self._next += 1

    def pair(self, *names: str, high: int = 0, low: int = 0) -> None:
        """Give two registers to each name: that of the high word has it, then comes ``NAME.low``.

        The high word of each is at an even number.
        """
        for name in names:
            self._next += self._next % 2
            self.word(name, init=high)
            self.word(f"{name}.low", init=low)

    def another(self, name: str, of: str) -> None:
        """Give a register a second name, for formulas in which it is something else."""
        self._add(name, self.numbers[of])

    def _add(self, name: str, number: int) -> None:
        if name in self.numbers:
            raise ValueError(f"there are two registers {name!r}")
        if number >= self.depth:
            raise ValueError(f"there is no register for {name!r}: {self.depth} are taken")
        self.numbers[name] = number

    def image(self, values: Mapping[str, int]) -> list[int]:
        """Return the first contents of all registers, with some values replaced."""
        words = [0] * self.depth
        for name, value in {**self.init, **values}.items():
            words[self.numbers[name]] = value
        return words


@dataclass(frozen=True)
class FormulaTable:
    """Rows that are carried out one after the other.

    Attributes
    ----------
    name : str
        Its name.
    rows : tuple of Row
        The rows: there are no jumps.
    """

    name: str
    rows: tuple[Row, ...]

    @classmethod
    def of(cls, name: str, registers: Registers,
           rows: Iterable[tuple[str, str, str, str]]) -> "FormulaTable":
        """Make a table of rows with names: of an operation, a, b and the destination."""
        return cls(name, tuple(Row(Operation[operation], *(registers[each] for each in names))
                               for operation, *names in rows))

    def clocks(self, width: int) -> int:
        """Return the clocks from ``start`` of :class:`Formulas` to its ``done``."""
        return 3 + sum(5 + row.operation.steps(width) + row.operation.words for row in self.rows)


class Formulas(wiring.Component):
    """Carries out tables of formulas, each in a number of clocks that depends on the table alone.

    Registers are in a memory with one read port, rows of tables in another. While it is not
    ``busy`` registers can be read and written from outside. Reset leaves registers as they are.

    Parameters
    ----------
    tables : sequence of FormulaTable
        The tables, with ``MAX_ROWS`` rows at most.
    init : sequence of int
        Contents of the registers at power-up; their number is a power of two, from 2.
    width : int
        Bits of a register, see :class:`ArithmeticUnit`.

    Members
    -------
    start : In(1)
        Begin, if not ``busy``.
    table : In(range(len(tables)))
        Number of the table.
    busy : Out(1)
        It is at work, from the clock after ``start``.
    done : Out(1)
        The table is through. One clock, the first that is not ``busy``,
        ``tables[table].clocks(width)`` after ``start``.
    address : In(range(len(init)))
        Number of a register, while not ``busy``.
    write : In(1)
        Write ``value`` to it. Only while not ``busy``.
    value : In(width)
        What is written.
    word : Out(width)
        What was in the register two clocks ago, if not ``busy`` nor written since then.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, tables: Sequence[FormulaTable], init: Sequence[int],
                 width: int = 36) -> None:
        self.tables = tuple(tables)
        self.depth = len(init)
        self.unit = ArithmeticUnit(width=width)
        self.width = width
        if self.depth < 2 or self.depth & (self.depth - 1):
            raise ValueError(f"number of registers must be a power of two, not {self.depth}")
        self.init = [in_range(f"register {number}", word, 0, (1 << width) - 1)
                     for number, word in enumerate(init)]
        in_range("number of tables", len(self.tables), 1, MAX_ROWS)
        for table in self.tables:
            in_range(f"number of rows of {table.name}", len(table.rows), 1, MAX_ROWS)
            for row in table.rows:
                for number in row[1:]:
                    in_range(f"register of {table.name}", number, 0, self.depth - 1)
        self.firsts: list[int] = []
        self.rows = 0
        for table in self.tables:
            self.firsts.append(-(-self.rows // ALIGNMENT) * ALIGNMENT)
            self.rows = in_range("number of rows", self.firsts[-1] + len(table.rows), 1, MAX_ROWS)
        super().__init__({
            "start": In(1), "table": In(range(len(self.tables))), "busy": Out(1), "done": Out(1),
            "address": In(range(self.depth)), "write": In(1), "value": In(width),
            "word": Out(width), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.unit = unit = self.unit
        numbers = range(self.depth)
        layout = data.StructLayout({"operation": Operation, "a": numbers, "b": numbers,
                                    "destination": numbers, "last": 1})
        rows = []
        for table, first in zip(self.tables, self.firsts, strict=True):
            rows += [_row(table.rows[0], last=True)] * (first - len(rows))
            rows += [_row(row, last=number == len(table.rows))
                     for number, row in enumerate(table.rows, 1)]
        images = [layout.const(row).as_value().value for row in rows]
        # One port, which does not read while it writes: else there would be a bypass around it.
        m.submodules.registers = registers = memory.Memory(shape=self.width, depth=self.depth,
                                                           init=self.init)
        write, read = registers.write_port(), registers.read_port()
        source, target = Signal(numbers), Signal(numbers)
        m.d.comb += [read.addr.eq(Mux(write.en, target, source)), write.addr.eq(read.addr),
                     read.en.eq(~write.en)]

        place = Signal(range(len(rows) + 1))  # of the row after the present one
        ahead, row = (Signal(layout, name=name) for name in ("ahead", "row"))
        word = Signal(self.width)
        # In slices of as many bits as a block RAM with all rows has: else there would be a choice
        # behind several.
        found = Signal(layout)
        for low in range(0, layout.size, SLICE):
            bits = min(SLICE, layout.size - low)
            m.submodules[f"rows_{low}"] = rom = memory.Memory(
                shape=unsigned(bits), depth=len(rows),
                init=[image >> low & (1 << bits) - 1 for image in images])
            following = rom.read_port()
            m.d.comb += [following.addr.eq(place),
                         found.as_value()[low:low + bits].eq(following.data)]
        # Registers behind both memories.
        m.d.sync += [word.eq(read.data), ahead.eq(found), self.done.eq(0)]
        m.d.comb += [
            self.word.eq(word), unit.data.eq(word), unit.operation.eq(row.operation),
            source.eq(row.a ^ 1),  # the low word, for as long as the unit may want it
            write.en.eq(unit.write), write.data.eq(unit.result),
            target.eq(row.destination ^ unit.second), self.busy.eq(1),
        ]

        # It is 0 at rest, so that the adder that counts it also takes the first.
        advance = Signal(range(len(rows)))
        m.d.sync += place.eq(place + advance)

        with m.FSM(name="formulas_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += [self.busy.eq(0), source.eq(self.address), target.eq(self.address),
                             write.data.eq(self.value), write.en.eq(self.write)]
                with m.If(self.start):
                    m.d.comb += advance.eq(look_up(self.firsts, self.table, len(place)))
                    m.next = "LOOK-UP"
            with m.State("LOOK-UP"):
                m.next = "WAIT"
            with m.State("WAIT"):
                m.next = "TAKE"
            with m.State("TAKE"):
                m.d.comb += [source.eq(ahead.a), advance.eq(1)]
                m.d.sync += row.eq(ahead)
                m.next = "READ-B"
            with m.State("READ-B"):
                m.d.comb += source.eq(row.b)
                m.next = "GO"
            with m.State("GO"):
                m.d.comb += unit.start.eq(1)
                m.next = "COMPUTE"
            with m.State("COMPUTE"):
                with m.If(unit.done):
                    m.next = "TAKE"
                    with m.If(row.last):
                        m.d.sync += [self.done.eq(1), place.eq(0)]
                        m.next = "IDLE"
            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | unit.fault)
        return m


def _row(row: Row, *, last: bool) -> Mapping[str, object]:
    return {**row._asdict(), "last": int(last)}
