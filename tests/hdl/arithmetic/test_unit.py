# amaranth: UnusedElaboratable=no

"""The arithmetic unit: every operation as its model, and in a known number of clocks."""

import random

import pytest

from fresa.arithmetic import ArithmeticUnit
from tb.benches.arithmetic import operations
from tb.boards import component
from tb.engines import AmaranthEngine, CXXRTLEngine


def check(engine, width: int, rng: random.Random, rounds: int) -> None:
    """Compute so often, with operands of all lengths, and compare words, flag and clocks."""
    for made in operations(rng, width, rounds):
        engine.set(start=1, operation=made.operation.value, data=made.high)
        engine.run(1)
        engine.set(start=0, data=made.b)
        engine.run(1)
        engine.set(data=made.low)
        engine.run(made.operation.steps(width) + 1)
        for second, word in enumerate(made.words):
            assert engine.get("write", "second") == (1, second)
            assert engine.get("done") == (second + 1 == made.operation.words)
            if word is not None:
                assert engine.get("result") == word, made
            engine.run(1)
        assert engine.get("write") == 0


class TestUnit:
    @pytest.mark.parametrize(("width", "rounds"), [(4, 200), (8, 200), (36, 100), (64, 30)])
    def test_computes_as_its_model(self, width, rounds):
        with AmaranthEngine(component("unit", ArithmeticUnit(width=width))) as engine:
            check(engine, width, random.Random(width), rounds)

    @pytest.mark.compiler
    @pytest.mark.parametrize("width", [8, 10, 36])
    def test_computes_as_its_model_compiled(self, width):
        with CXXRTLEngine(component("unit", ArithmeticUnit(width=width))) as engine:
            check(engine, width, random.Random(width), 4_000)

    @pytest.mark.parametrize("width", [3, 2, 65, 66, 9, 36.0])
    def test_refuses_other_widths(self, width):
        with pytest.raises(ValueError, match=f"width must be .*, not {width}"):
            ArithmeticUnit(width=width)
