"""Impossible values are named."""

import re

import pytest

from fresa.checks import in_range, power_of_two


class TestInRange:
    @pytest.mark.parametrize("value", [1, 2, 7])
    def test_gives_the_value_back(self, value):
        assert in_range("size", value, 1, 7) is value

    @pytest.mark.parametrize("value", [0, 8, -1, 1.0, 2.5, "3", None, True, float("nan")])
    def test_names_parameter_and_value(self, value):
        message = f"size must be a whole number from 1 to 7, not {value!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            in_range("size", value, 1, 7)


class TestPowerOfTwo:
    @pytest.mark.parametrize("value", [2, 4, 16])
    def test_gives_the_value_back(self, value):
        assert power_of_two("depth", value, 2, 16) is value

    @pytest.mark.parametrize("value", [3, 6, 15])
    def test_names_parameter_and_value(self, value):
        with pytest.raises(ValueError, match=f"^depth must be a power of two, not {value}$"):
            power_of_two("depth", value, 2, 16)

    @pytest.mark.parametrize("value", [1, 32, 2.0, None])
    def test_has_a_range(self, value):
        with pytest.raises(ValueError, match="^depth must be a whole number from 2 to 16, not "):
            power_of_two("depth", value, 2, 16)
