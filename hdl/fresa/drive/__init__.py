"""Steps to pins: dividers, phase sequences, the drivers of the motors."""

from .axes import AxisDrivers
from .coil import CoilDriver
from .divider import MAX_PERIOD, FrequencyDivider, valid_period
from .pending import PendingSteps
from .phase import PhaseDriver
from .rate import MAX_MODULUS, RateGenerator
from .sequences import FULL_STEP, HALF_STEP, ONE_PHASE, swap_inner
from .spindle import (
    FULL_POWER,
    MIN_SERVO_PERIOD,
    SERVO_PERIOD,
    PowerPWM,
    ServoPulse,
    SpindlePower,
    pwm_frequency,
)
from .step_dir import MAX_PULSE, StepDirDriver
from .step_dir_pair import StepDirPair
from .string_motor import MAX_LENGTH_BITS, StringMotor

__all__ = [
    "FULL_POWER", "FULL_STEP", "HALF_STEP", "MAX_LENGTH_BITS", "MAX_MODULUS", "MAX_PERIOD",
    "MAX_PULSE", "MIN_SERVO_PERIOD", "ONE_PHASE", "SERVO_PERIOD", "AxisDrivers", "CoilDriver",
    "FrequencyDivider", "PendingSteps", "PhaseDriver", "PowerPWM", "RateGenerator", "ServoPulse",
    "SpindlePower", "StepDirDriver", "StepDirPair", "StringMotor", "pwm_frequency", "swap_inner",
    "valid_period",
]
