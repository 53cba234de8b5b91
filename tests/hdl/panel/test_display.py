# amaranth: UnusedElaboratable=no

"""The display, as an eye sees it."""

import pytest

from fresa.panel import SevenSegment
from tb.boards import component
from tb.engines import AmaranthEngine

#: The digits, three rows of three each, as on paper.
SHAPES = """
 _     _  _     _  _  _  _  _  _     _     _  _
| |  | _| _||_||_ |_   ||_||_||_||_ |   _||_ |_
|_|  ||_  _|  | _||_|  ||_| _|| ||_||_ |_||_ |
"""
#: a to g: row and column of the stroke.
STROKES = [(0, 1), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (1, 1)]


def drawn(digit: int) -> int:
    rows = [row.ljust(48) for row in SHAPES.strip("\n").split("\n")]
    return sum(
        1 << bit
        for bit, (row, column) in enumerate(STROKES)
        if rows[row][3 * digit + column] != " "
    )


def display(scan_bits: int) -> AmaranthEngine:
    return AmaranthEngine(component("display", SevenSegment(scan_bits=scan_bits)))


class TestSevenSegment:
    @pytest.mark.parametrize("value", [0x0123, 0x4567, 0x89AB, 0xCDEF, 0xFEDC, 0x0000])
    def test_shows_each_digit_in_its_place(self, value):
        with display(3) as engine:
            engine.set(value=value, enable=1)
            seen = engine.apply({"rst": [0] * 32}, ["segments", "digits"])
        shown = {}
        for segments, digits in zip(
            seen["segments"].tolist(), seen["digits"].tolist(), strict=True
        ):
            lit = [n for n in range(4) if not digits >> n & 1]
            assert len(lit) <= 1
            for place in lit:
                shown.setdefault(place, set()).add(0xFF ^ segments)
        assert shown == {n: {drawn(value >> 4 * n & 15)} for n in range(4)}
