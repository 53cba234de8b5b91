# amaranth: UnusedElaboratable=no

"""Both modes before one set of motors: what it does is tested with the machine."""

import re

import pytest

from fresa.motion import NumericalController


class TestParameters:
    @pytest.mark.parametrize(
        ("name", "value", "message"),
        [
            ("period", 0, "period must be a whole number from 1 to 67108864, not 0"),
            ("jog_period", 0, "jog_period must be a whole number from 1 to 67108864, not 0"),
            ("z_travel", 0, "z_travel must be a whole number from 1 to 32768, not 0"),
        ],
    )
    def test_impossible_values(self, name, value, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            NumericalController(**{"period": 2, "z_travel": 3, name: value})
