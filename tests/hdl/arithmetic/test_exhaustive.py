# amaranth: UnusedElaboratable=no

"""Every operation of the arithmetic unit, with every operand of a few bits."""

from functools import cache

import numpy as np
import pytest

from fresa.arithmetic import ArithmeticUnit, Operation
from tb.boards import component
from tb.design import Design
from tb.engines import CXXRTLEngine
from tb.models.arithmetic import compute

NO_PAIR = {"ADD", "ADD_CARRY", "SUBTRACT", "SUBTRACT_BORROW", "DIFFERENCE", "SELECT", "NEGATE",
           "RATIO", "MULTIPLY"}
NO_B = {"ROOT", "NORMALISE"}


def check(engine, operation: Operation, operands: np.ndarray, flag: int, width: int) -> None:
    """Compute rows of (high, low, b), one after the other, each after one that sets the flag."""
    clocks = operation.steps(width) + 4 + operation.words
    slot = np.zeros((len(operands), 5 + clocks), np.int64)
    start, data = slot.copy(), slot.copy()
    start[:, [0, 5]] = 1
    slot[:, 0], slot[:, 5:] = Operation.SUBTRACT.value, operation.value
    data[:, 1] = flag  # 0 - it
    data[:, 5], data[:, 6], data[:, 7:] = operands[:, 0], operands[:, 2], operands[:, 1:2]
    seen = engine.apply({"start": start.ravel(), "operation": slot.ravel(), "data": data.ravel()},
                        ["write", "result"])
    write, result = (seen[name].reshape(slot.shape) for name in ("write", "result"))
    first = 5 + operation.steps(width) + 3
    assert (write[:, 5:] == [first <= clock < first + operation.words
                             for clock in range(5, 5 + clocks)]).all()
    for (high, low, b), found in zip(operands.tolist(), result[:, first:].tolist(), strict=True):
        words, _ = compute(operation.name, high, low, b, flag, width=width)
        assert all(word is None or word == other
                   for word, other in zip(words, found, strict=False)), (high, low, b, flag)


@cache
def unit(width: int) -> Design:
    return component("unit", ArithmeticUnit(width=width))


@pytest.mark.compiler
@pytest.mark.parametrize("operation", Operation)
def test_every_operand(operation):
    """Of 8 bits where there are two or less, and of 4 where there are three."""
    two = operation.name in NO_PAIR | NO_B
    width = 8 if two else 4
    size = range(1 << width)
    high, low, b = np.meshgrid(size, [1] if operation.name in NO_PAIR else size,
                               [1] if operation.name in NO_B else size, indexing="ij")
    operands = np.stack([each.ravel() for each in (high, low, b)], axis=1)
    with CXXRTLEngine(unit(width)) as engine:
        for flag in (0, 1):
            check(engine, operation, operands, flag, width)
