# amaranth: UnusedElaboratable=no

"""A level that must be steady before it acts."""

import re

import pytest

from fresa.panel import GlitchFilter


@pytest.mark.parametrize("period", [0, -1, 2**26 + 1, 1.0])
def test_impossible_periods(period):
    message = f"filter period must be a whole number from 1 to 67108864, not {period!r}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        GlitchFilter(period=period)
