# amaranth: UnusedElaboratable=no

"""The arithmetic unit: no operand of the first operations after power-up gives a wrong result."""

import pytest

from fresa.arithmetic import ArithmeticUnit
from tb.contracts.arithmetic import ARITHMETIC
from tb.contracts.contract import Contract
from tb.contracts.proof import reach


def failures(width: int, depth: int, folder) -> tuple[set[str], set[str]]:
    """Return the properties that can fail, and those whose premises can come about."""
    dut = {"dut": ArithmeticUnit(width=width), "describe": ARITHMETIC.describe}
    wrong, right = folder / "wrong", folder / "right"
    wrong.mkdir()
    right.mkdir()
    return (set(reach(Contract(**dut, broken=True), wrong, depth)),
            set(ARITHMETIC.properties()) - set(reach(Contract(**dut), right, depth)))


@pytest.mark.proof
@pytest.mark.parametrize(("width", "depth"), [(4, 13), (8, 16)])
def test_no_result_is_wrong(width, depth, tmp_path):
    assert failures(width, depth, tmp_path) == (set(), set())
