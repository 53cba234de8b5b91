"""Choices and sums in few lookup tables, at every input of small ones."""

from itertools import product

import pytest
from amaranth import Module, Signal, signed
from amaranth.sim import Simulator

from fresa.choice import ALL_ONES, add_choice, choice_code, choose, look_up


def evaluated(expression, shape, inputs: list[Signal], rows) -> list[int]:
    """Return what an expression is, as a signal of a shape, for rows of its inputs."""
    m, output, found = Module(), Signal(shape), []
    m.d.comb += output.eq(expression)

    async def bench(ctx):
        for row in rows:
            for signal, value in zip(inputs, row, strict=True):
                ctx.set(signal, value)
            found.append(ctx.get(output))

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()
    return found


@pytest.mark.parametrize("count", [2, 4, 6])
def test_a_word_is_chosen_by_its_code(count):
    words, bits = [Signal(3, name=f"word_{number}") for number in range(count)], count // 2 + 1
    code = Signal(bits)
    values = [5, 3, 6, 1, 2, 7][:count]
    rows = [(*values, choice_code(number)) for number in range(count)]
    rows += [(*values, 0), (*values, ALL_ONES)]
    assert evaluated(choose(words, code, 3), 3, [*words, code], rows) == [*values, 0, 0b111]


def test_a_constant_is_looked_up():
    number, words = Signal(3), [3, 0, 2, 1, 3]
    found = evaluated(look_up(words, number, 2), 2, [number], [(each,) for each in range(8)])
    assert found == [*words, 0, 0, 0]


@pytest.mark.parametrize("shape", [4, signed(4)])
def test_a_sum_is_one(shape):
    number, chosen, carry = Signal(shape), Signal(shape), Signal()
    least = -8 if shape != 4 else 0
    rows = [*product(range(least, least + 16), range(least, least + 16), range(2))]
    inputs = [number, chosen, carry]
    for expression, sums in (
            (add_choice(number, chosen, carry), [sum(row) for row in rows]),
            (add_choice(number, chosen), [a + b for a, b, _ in rows])):
        assert evaluated(expression, 4, inputs, rows) == [each % 16 for each in sums]
