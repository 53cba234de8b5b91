"""Steps to pins: dividers, phase sequences, the drivers of the motors."""

from .axes import AxisDrivers
from .coil import CoilDriver
from .divider import MAX_PERIOD, FrequencyDivider, valid_period
from .phase import PhaseDriver
from .sequences import FULL_STEP, HALF_STEP, ONE_PHASE, bipolar

__all__ = [
    "FULL_STEP", "HALF_STEP", "MAX_PERIOD", "ONE_PHASE", "AxisDrivers", "CoilDriver",
    "FrequencyDivider", "PhaseDriver", "bipolar", "valid_period",
]
