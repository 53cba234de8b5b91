"""Benches of the arithmetic unit, and of tables of formulas that it carries out."""

import random
from collections.abc import Iterator
from dataclasses import dataclass

from fresa.arithmetic import ArithmeticUnit, Formulas, FormulaTable, Operation, Row

from ..bench import Run, bench
from ..models.arithmetic import compute, run_table

ROUNDS = 1200
WIDTH = 4
"""Bits of a word: every case comes often."""
FREE, LOW, CONSTANTS = 8, 9, {10: 3, 11: 8, 12: 5, 13: 1 << WIDTH - 1, 14: (1 << WIDTH) - 1, 15: 6}
"""Registers that may be anything; one behind a 0, with which it is a pair; those that stay."""
TOP, ONES = 13, 14


@dataclass(frozen=True)
class Computed:
    """An operation with its operands, and the words of its result, None for one that may be any."""

    operation: Operation
    high: int
    low: int
    b: int
    words: list[int | None]


def operations(rng: random.Random, width: int, rounds: int) -> Iterator[Computed]:
    """Make so many operations, one after the other, with operands of all lengths."""
    flag = 0
    for _ in range(rounds):
        operation = rng.choice(list(Operation))
        high, low, b = (rng.getrandbits(rng.randint(0, width)) for _ in range(3))
        if operation.name.startswith("SHIFT"):
            b = rng.choice([rng.randint(0, width + 4), rng.randrange(2 << width.bit_length())])
        if operation is Operation.RATIO:
            b = max(1, b)
            high %= 2 * b
        if operation is Operation.REMAINDER:
            b = max(1, b)
            high %= b
        words, flag = compute(operation.name, high, low, b, flag, width=width)
        yield Computed(operation, high, low, b, words)


@bench
def arithmetic_unit(run: Run) -> str:
    """Every operation, as its model and in its clocks."""
    dut = ArithmeticUnit(width=WIDTH)

    async def test(ctx):
        for made in operations(random.Random(1), WIDTH, ROUNDS):
            ctx.set(dut.start, 1)
            ctx.set(dut.operation, made.operation)
            ctx.set(dut.data, made.high)
            run.see(ctx, dut, write=0, done=0, fault=0)
            await ctx.tick()
            ctx.set(dut.start, 0)
            for word in (made.b, *[made.low] * (made.operation.steps(WIDTH) + 1)):
                ctx.set(dut.data, word)
                run.see(ctx, dut, write=0, done=0, fault=0)
                await ctx.tick()
            for second, word in enumerate(made.words):
                run.see(ctx, dut, write=1, second=second, fault=0,
                        done=int(second + 1 == made.operation.words))
                if word is not None:
                    run.see(ctx, dut, result=word)
                await ctx.tick()

    run.simulate(dut, test, deadline=20 * ROUNDS)
    return f"{ROUNDS} operations, each with the words of its model after its own clocks"


def _table(rng: random.Random, number: int, rows: int) -> FormulaTable:
    """Make a table of rows of which each result is known, whatever is in the registers."""
    made = [Row(Operation.SUBTRACT, *(rng.randrange(FREE) for _ in range(3)))]  # sets the flag
    every = list(Operation)
    while len(made) < rows:
        operation = every[(len(made) + 7 * number) % len(every)]
        a, b, destination = (rng.randrange(FREE) for _ in range(3))
        if operation in (Operation.SHIFT_LEFT, Operation.SHIFT_RIGHT):
            b = rng.choice([10, 11, 12, 15])
        if operation is Operation.RATIO:
            b = rng.choice([TOP, ONES])
        if operation is Operation.REMAINDER:
            a, b = FREE, ONES
        if operation.words == 1 and rng.random() < 0.2:
            destination = LOW
        made.append(Row(operation, a, b, destination))
    return FormulaTable(f"table {number}", tuple(made))


@bench
def formulas(run: Run) -> str:
    """Tables of all operations, one of a single row; registers before and after."""
    rng = random.Random(2)
    tables = [_table(rng, number, rows) for number, rows in enumerate((20, 1, 17, 33))]
    words = [rng.getrandbits(WIDTH) if number < FREE or number == LOW else CONSTANTS.get(number, 0)
             for number in range(16)]
    dut = Formulas(tables=tables, init=words, width=WIDTH)
    rounds = 24

    async def registers(ctx):
        """See each register two clocks after its number."""
        for number in range(len(words) + 2):
            ctx.set(dut.address, number % len(words))
            if number >= 2:
                run.see(ctx, dut, word=words[number - 2], busy=0, done=0, fault=0)
            await ctx.tick()

    async def test(ctx):
        nonlocal words
        await registers(ctx)
        for _ in range(rounds):
            for number in rng.sample(range(FREE), 5):
                words[number] = rng.getrandbits(rng.randint(1, WIDTH))
                ctx.set(dut.address, number)
                ctx.set(dut.value, words[number])
                ctx.set(dut.write, 1)
                await ctx.tick()
            ctx.set(dut.write, 0)
            place = rng.randrange(len(tables))
            ctx.set(dut.table, place)
            ctx.set(dut.start, 1)
            run.see(ctx, dut, busy=0, done=0)
            await ctx.tick()
            for clock in range(1, tables[place].clocks(WIDTH)):
                # While it is busy none of these matters.
                for port in (dut.start, dut.table, dut.write, dut.address, dut.value):
                    ctx.set(port, rng.randrange(1 << len(port)))
                run.see(ctx, dut, busy=1, done=0, fault=0)
                if clock + 1 == tables[place].clocks(WIDTH):
                    ctx.set(dut.start, 0)
                    ctx.set(dut.write, 0)
                await ctx.tick()
            run.see(ctx, dut, busy=0, done=1)
            await ctx.tick()
            words = run_table([(row.operation.name, *row[1:]) for row in tables[place].rows],
                              words, width=WIDTH)
            await registers(ctx)

    run.simulate(dut, test, deadline=1000 * rounds)
    return f"{rounds} times one of {len(tables)} tables: all registers, and the clocks it takes"
