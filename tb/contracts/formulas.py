# amaranth: UnusedElaboratable=no

"""Contract of tables of formulas: each ends after its clocks, its rows are done in order."""

from collections.abc import Iterator
from typing import Any

from amaranth import Array, Const, Mux, Value
from amaranth.lib import data, memory

from fresa.arithmetic.formulas import Formulas, FormulaTable, Row
from fresa.arithmetic.unit import Operation

from .arithmetic_unit import ARITHMETIC_UNIT, clocks
from .contract import Bits, Case, Component, Contract

__all__ = ["FORMULAS"]

REGISTERS = [0, 1, 2, 3]

LOOK_UP, FETCH = 3, 2
"""Clocks from a start to the first row, and from a row to the start of its operation."""


def describe(c: Contract, dut: Formulas) -> None:
    """By the clocks since the start, of which each row has its own, and by the registers."""
    c.keeps("unit", ARITHMETIC_UNIT)
    unit, state = dut.unit, c.state("formulas_state")
    numbers = range(dut.depth)
    rows = [row for table in dut.tables for row in table.rows]
    ends = [fields["over"] for fields in _of_rows(dut) if fields["last"]]
    firsts = [sum(len(each.rows) for each in dut.tables[:number])
              for number in range(len(dut.tables))]
    at = c.keep(range(len(rows)), name="at")  # the row
    table = c.keep(range(len(dut.tables)), name="table")
    age = c.keep(range(max(ends) + 1), name="age")  # clocks since the start; 0 at rest
    ended = c.keep(1, name="ended")

    # All that is known of each row.
    layout = data.StructLayout({
        "begin": range(max(ends) + 1), "over": range(max(ends) + 1), "place": range(dut.rows),
        "operation": Operation, "a": numbers, "b": numbers, "destination": numbers, "last": 1})
    c.m.submodules.rows = known = memory.Memory(shape=layout, depth=len(rows) + 1, init=[
        {**row._asdict(), **fields} for row, fields in zip(rows, _of_rows(dut), strict=True)])
    this, next_ = (known.read_port(domain="comb") for _ in range(2))
    c.m.d.comb += [this.addr.eq(at), next_.addr.eq(at + 1)]
    expected = this.data
    begin, over, operation = expected.begin, expected.over, expected.operation.as_value()
    end = Array(Const(value, max(ends).bit_length()) for value in ends)[table]
    is_last = age == end - 1
    c.m.d.sync += ended.eq((age != 0) & is_last & ~c.rst)
    with c.m.If(age == 0):
        with c.m.If(dut.start):
            c.m.d.sync += [age.eq(1), table.eq(dut.table),
                           at.eq(Array(firsts)[dut.table])]
    with c.m.Else():
        c.m.d.sync += age.eq(Mux(is_last, 0, age + 1))
        with c.m.If((age == over - 1) & ~is_last):
            c.m.d.sync += at.eq(at + 1)
    with c.m.If(c.rst):
        c.m.d.sync += age.eq(0)
    c.assume(dut.table < len(dut.tables))
    c.assume((age == 0) | ~dut.write)

    at_work = age != 0
    since = age - begin  # the row has begun, if it is not below 0
    starts = at_work & (since == FETCH)
    c.invariant("done-in-time", "A table is through after the clocks that its rows take.",
                dut.done == ended, cover=dut.done & (c.past(age) == max(ends) - 1))
    c.invariant("busy", "Until then it is busy.", dut.busy == at_work, cover=dut.busy)
    c.invariant("rows-in-order", "The operations of its rows begin one after the other.",
                (unit.start == starts) & (~unit.start | (unit.operation.as_value() == operation)),
                cover=unit.start & (at == len(rows) - 1))

    working = at_work & (since > FETCH)
    unit_age = since - FETCH
    _registers(c, dut, at_work, Mux(working, unit_age, 0), expected)

    place, row, ahead, found = (c.signal(name) for name in ("place", "row", "ahead", "found"))
    position, more = expected.place, ~row[-1]
    here, following = (port.data.as_value()[-len(row):] for port in (this, next_))
    if not c.upset:
        kept_age = c.kept["unit:age"]
        c.invariant("clocks-of-states", "Each state has its clocks of a row.", _all(
            state("IDLE") == ~at_work, state("LOOK-UP") == (age == 1), state("WAIT") == (age == 2),
            state("TAKE") == (at_work & (since == 0)), state("READ-B") == (at_work & (since == 1)),
            state("GO") == starts, state("COMPUTE") == working,
            ~at_work | (age < end), ~(at_work & (since >= 0)) | (age < over),
            kept_age == Mux(working, unit_age, 0),
            ~working | (Value.cast(c.kept["unit:operation"]) == operation)),
            cover=state("COMPUTE"), lemma=True)
        c.invariant("row-of-table", "The row is one of the table.", ~at_work | Value.cast(
            Array(Const(low, 16) for low in firsts)[table] <= at) & (
            at < Array(Const(low + len(each.rows), 16) for low, each in zip(
                firsts, dut.tables, strict=True))[table]) & ((age > 2) | (
                    at == Array(firsts)[table])),
            cover=at_work, lemma=True)
        c.invariant("rows", "The row is there in time, and the one after it.", _all(
            ~state("IDLE") | (place == 0), ~state("LOOK-UP", "WAIT", "TAKE") | (place == position),
            ~state("READ-B", "GO", "COMPUTE") | (place == position + 1),
            ~state("WAIT") | (found == here),
            ~state("TAKE") | (ahead == here),
            ~state("READ-B", "GO", "COMPUTE") | (row == here),
            ~(state("GO", "COMPUTE") & more) | (found == following),
            ~(state("COMPUTE") & more) | (ahead == following)),
            cover=state("TAKE"), lemma=True)
    c.leaves_unused_codes("formulas_state", fault=dut.fault, shows=dut.busy & ~unit.start)


def _registers(c: Contract, dut: Formulas, at_work: Bits, unit_age: Bits, row: Any) -> None:
    """State what an operation is given, where its result goes, and that all else stays."""
    unit, numbers = dut.unit, (dut.depth - 1).bit_length()
    words = c.words("registers")

    def register(number: Bits) -> Bits:
        return Array(words)[number]

    written = c.keep(1, name="written")  # the first word of the result
    c.m.d.sync += written.eq(unit.write & ~c.rst)
    c.implication("first-operand", "An operation begins with the first of its registers.",
                  when=unit.start, then=unit.data == register(row.a))
    c.implication("second-operand", "The second comes in the clock after that.",
                  when=unit_age == 1, then=unit.data == register(row.b))
    c.implication("low-word", "From then on there is the low word of the first.",
                  when=(unit_age > 1) & ~written, then=unit.data == register(row.a ^ 1))
    number = (row.destination ^ unit.second)[:numbers]
    c.implication("results", "A word of a result is in its register a clock later.",
                  when=c.past(unit.write), then=register(c.past(number)) == c.past(unit.result))
    c.implication("values", "So is one from outside.", when=c.past(dut.write & ~at_work),
                  then=register(c.past(dut.address)) == c.past(dut.value))
    where = c.free(numbers, name="where")
    writes = Mux(at_work, unit.write & (number == where), dut.write & (dut.address == where))
    c.implication("others-stay", "No other register changes.",
                  when=c.past(1) & ~c.past(writes),
                  then=register(c.past(where)) == c.past(register(where)))
    asked = ~at_work & ~dut.write
    c.implication("reads", "A register can be read while it is at rest.",
                  when=c.past(c.past(asked)) & ~c.past(c.rst),
                  then=dut.word == c.past(c.past(register(dut.address))))


def _all(*conditions: Bits) -> Bits:
    found: Bits = Const(1)
    for each in conditions:
        found = found & Value.cast(each).any()
    return found


def _of_rows(dut: Formulas) -> Iterator[dict[str, int]]:
    """Give for each row when it begins and is over, where it is, and if it is the last."""
    for table, first in zip(dut.tables, dut.firsts, strict=True):
        time = LOOK_UP
        for number, row in enumerate(table.rows):
            over = time + FETCH + clocks(row.operation, dut.width) + row.operation.words
            yield {"begin": time, "over": over, "place": first + number,
                   "last": int(number == len(table.rows) - 1)}
            time = over


def make(*, width: int) -> Formulas:
    """Make one whose tables are short: a G-code machine has a thousand rows, beyond the prover."""
    rows = Row(Operation.ADD, 0, 1, 2), Row(Operation.SHIFT_LEFT, 2, 1, 0)
    return Formulas(width=width, init=REGISTERS, tables=[
        *(FormulaTable(each.name, (Row(each, 3, 2, 3),)) for each in ONE_ROW),
        FormulaTable("two", rows)])


ONE_ROW = (Operation.ADD_CARRY, Operation.SUBTRACT, Operation.SUBTRACT_BORROW,
           Operation.DIFFERENCE, Operation.SELECT, Operation.NEGATE)
"""Tables, beside one of two rows: what the unit's contract computes."""

FORMULAS = Component(make=make, describe=describe, depth=26, cases=(
    Case({"width": 4}), Case({"width": 36}, real=True), Case({"width": 4}, upset=True)))
