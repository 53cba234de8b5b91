"""Steps to pins: dividers, phase sequences, the drivers of the motors."""

from .axes import AxisDrivers
from .coil import FULL_STEP, CoilDriver
from .divider import MAX_PERIOD, FrequencyDivider, valid_period

__all__ = [
    "FULL_STEP", "MAX_PERIOD", "AxisDrivers", "CoilDriver", "FrequencyDivider", "valid_period",
]
