# amaranth: UnusedElaboratable=no

"""The display, as an eye sees it."""

import re

import numpy as np
import pytest

from fresa.clock import CLOCK
from fresa.machines.mill import MillTiming
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

    @pytest.mark.parametrize("scan_bits", [3, 4, 6])
    def test_every_digit_has_the_same_time(self, scan_bits):
        turn = 1 << scan_bits
        with display(scan_bits) as engine:
            engine.set(value=0x1234, enable=1)
            digits = engine.apply({"rst": [0] * 12 * turn}, ["digits"])["digits"] ^ 0xF
        for place in range(4):
            on = np.flatnonzero(digits >> place & 1)
            assert len(on) == 3 * (turn - 2 * (turn // 8))
            assert set(np.diff(on)) == {1, 3 * turn + 2 * (turn // 8) + 1}

    def test_nothing_ghosts(self):
        """Segments change only while no digit is on, some time after one was and before one is."""
        with display(6) as engine:
            engine.set(value=0x1234, enable=1)
            seen = engine.apply({"rst": [0] * 512}, ["segments", "digits"])
        changes = np.flatnonzero(np.diff(seen["segments"])) + 1
        assert len(changes) >= 6
        for clock in changes:
            assert (seen["digits"][max(0, clock - 8) : clock + 8] == 0xF).all()

    def test_dark_without_enable(self):
        with display(3) as engine:
            engine.set(value=0x8888)
            assert (engine.apply({"rst": [0] * 64}, ["digits"])["digits"] == 0xF).all()

    def test_point_is_never_lit(self):
        with display(3) as engine:
            seen = engine.apply(
                {"value": [n * 0x1111 for n in range(16) for _ in range(8)], "enable": [1] * 128},
                ["segments"],
            )
        assert (seen["segments"] >> 7 == 1).all()

    def test_refresh_on_the_board(self):
        assert CLOCK / (4 << MillTiming.real().scan_bits) >= 60

    @pytest.mark.parametrize("scan_bits", [2, 25, -1, 3.0])
    def test_impossible_scan_bits(self, scan_bits):
        message = f"scan_bits must be a whole number from 3 to 24, not {scan_bits!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            SevenSegment(scan_bits=scan_bits)
