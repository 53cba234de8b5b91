# amaranth: UnusedElaboratable=no

"""The periods that the divider takes."""

import pytest

from fresa.drive import MAX_PERIOD, FrequencyDivider, valid_period


def test_periods_of_the_machines():
    for period in (1, 493_214, MAX_PERIOD):
        assert FrequencyDivider(period=period).period == valid_period(period) == period
    with pytest.raises(ValueError, match=r"^jog_period must be .*, not 0$"):
        valid_period(0, name="jog_period")
