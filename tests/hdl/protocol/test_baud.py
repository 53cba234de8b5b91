"""Baud rates, and clocks that cannot have them."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fresa.protocol import bit_period


class TestBitPeriod:
    @pytest.mark.parametrize(("clock", "baud", "period"), [
        (50_000_000, 9600, 5208), (50_000_000, 19_200, 2604), (50_000_000, 115_200, 434),
        (50_000_000, 3_125_000, 16), (50_000_000, 3_000_000, 17), (16_000_000, 1, 16_000_000),
        (2**26, 1, 2**26), (16, 1, 16), (1_000_000_000, 300, 3_333_333),
    ])
    def test_nearest(self, clock, baud, period):
        assert bit_period(clock, baud) == period

    @given(st.integers(16, 10**9), st.integers(1, 10**8))
    def test_two_percent_and_no_more(self, clock, baud):
        """What is refused has no period that would do; what is given is within 2 %."""
        exact = clock / baud
        errors = {period: abs(clock / period / baud - 1)
                  for period in (int(exact), int(exact) + 1) if 16 <= period <= 2**26}
        try:
            period = bit_period(clock, baud)
        except ValueError:
            assert not errors or min(errors.values()) > 0.02 - 1e-12 or exact < 16
        else:
            assert errors[period] <= 0.02 + 1e-12

    @pytest.mark.parametrize(("clock", "baud", "message"), [
        (50_000_000, 0, "baud at a clock of 50000000 Hz must be a whole number from 1 to 3125000, "
                        "not 0"),
        (50_000_000, 3_125_001, "baud at a clock of 50000000 Hz must be a whole number from 1 to "
                                "3125000, not 3125001"),
        (10**9, 10, "baud at a clock of 1000000000 Hz must be a whole number from 15 to 62500000, "
                    "not 10"),
        (50_000_000, 9600.0, "baud at a clock of 50000000 Hz must be a whole number from 1 to "
                             "3125000, not 9600.0"),
        (15, 1, "clock must be a whole number from 16 to 1000000000, not 15"),
        ("50 MHz", 1, "clock must be a whole number from 16 to 1000000000, not '50 MHz'"),
        (33_000_000, 2_000_000, "baud 2000000 cannot be had from a clock of 33000000 Hz: 17 clocks "
                                "a bit are 1941176 baud, more than 2 % off"),
    ])
    def test_what_cannot_be_had_is_named(self, clock, baud, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            bit_period(clock, baud)
