"""Duty of LEDs and segments, against levels counted clock by clock."""

from math import ceil

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tb.engines import Changes
from tools.board.lights import LIGHTS, MOST_OF_A_DIGIT, Lights

DARK = {"leds": 0, "segments": 0xFF, "digits": 0xF}


def changes(rows: list[tuple[int, dict[str, int]]]) -> Changes:
    return Changes(np.array([clock for clock, _ in rows], np.int64),
                   {name: np.array([levels[name] for _, levels in rows], np.int64)
                    for name in LIGHTS})


def counted(levels: list[dict[str, int]]) -> tuple[bytes, bytes]:
    """Count each light clock by clock."""
    leds = [sum(level["leds"] >> n & 1 for level in levels) for n in range(8)]
    display = [sum(not level["digits"] >> digit & 1 and not level["segments"] >> segment & 1
                   for level in levels) for digit in range(4) for segment in range(8)]
    return (bytes(ceil(255 * n / len(levels)) for n in leds),
            bytes(ceil(min(255, 255 * n / len(levels) / MOST_OF_A_DIGIT)) for n in display))


levels = st.fixed_dictionaries({
    "leds": st.integers(0, 255), "segments": st.integers(0, 255), "digits": st.integers(0, 15)})


class TestLights:
    @settings(deadline=None)
    @given(st.lists(levels, min_size=2, max_size=60), st.data())
    def test_equals_the_count_however_cut(self, rows, data):
        """The first of `rows` holds before clock 1; row n holds after edge n."""
        last = len(rows) - 1
        cuts = sorted(data.draw(st.sets(st.integers(1, last), max_size=4)) | {last})
        lights, first = Lights(), 1
        for cut in cuts:
            part = [(n, rows[n]) for n in range(first, cut + 1) if rows[n] != rows[n - 1]]
            lights.feed(rows[first - 1], changes(part), first, cut)
            first = cut + 1
        got = lights.take()
        expected = counted(rows[1:])
        assert got is not None
        # A whole number may be rounded from a little beside it.
        for mine, theirs in zip(got, expected, strict=True):
            assert all(abs(a - b) <= 1 for a, b in zip(mine, theirs, strict=True))
            assert [a > 0 for a in mine] == [b > 0 for b in theirs]
        assert lights.take() is None

    def test_one_clock_shows_what_is_now(self):
        lights = Lights()
        lights.feed(DARK, changes([(5, {"leds": 0x80, "segments": 0xFE, "digits": 0xB})]), 5, 5)
        assert lights.take() == (bytes([0] * 7 + [255]), bytes([0] * 16 + [255] + [0] * 15))

    def test_a_digit_that_has_all_of_its_turn_is_bright(self):
        """Four turns of eight clocks, each with a dark first and last clock, as the board has."""
        rows = [(8 * turn + at, {"leds": 0, "segments": 0, "digits": 0xF ^ (1 << turn) * lit})
                for turn in range(4) for at, lit in ((0, 0), (1, 1), (7, 0))]
        lights = Lights()
        lights.feed(DARK, changes(rows), 0, 31)
        assert lights.take() == (bytes(8), bytes([255] * 32))
