# amaranth: UnusedElaboratable=no

"""Limits of what components are made with, and that an error names the parameter and its value."""

import re

import pytest

from fresa.drive import (
    FULL_STEP,
    AxisDrivers,
    CoilDriver,
    FrequencyDivider,
    PhaseDriver,
    RateGenerator,
    StepDirDriver,
)
from fresa.motion import (
    AutomaticControl,
    Backlash,
    Limits,
    ManualControl,
    MotionSequencer,
    MoveTo,
    NumericalController,
    OrderControl,
    OrderLedger,
    PointStore,
    SpiralWalk,
    SquareGenerator,
)
from fresa.panel import Debouncer, Monitor, SevenSegment
from fresa.protocol import (
    DecimalReader,
    DecimalWriter,
    FixedPoint,
    GCodeCoordinates,
    GCodeInterpreter,
    GCodeLine,
    GCodeReader,
    HexReader,
    HexWriter,
    LineBuffer,
    LineReader,
    UARTReceiver,
    UARTTransmitter,
    UnitConverter,
)

PERIOD = 2**26
RATE = {"modulus": 50, "max_rate": 1}
TIMES = dict.fromkeys(("width", "low", "setup", "hold"), 1)
STEPS = {"period": 2, "z_travel": 3}
LIMITS = [  # component, what it is made with, parameter, its name in the message, least, most
    (AxisDrivers, {}, "period", "period", 1, PERIOD),
    (CoilDriver, {}, "period", "period", 1, PERIOD),
    (FrequencyDivider, {}, "period", "period", 1, PERIOD),
    (PhaseDriver, {"sequence": FULL_STEP}, "period", "period", 1, PERIOD),
    (RateGenerator, RATE, "modulus", "modulus", 1, 2**40),
    (RateGenerator, RATE, "max_rate", "max_rate", 1, 50),
    *((StepDirDriver, TIMES, name, name, 1, 2**16) for name in TIMES),
    (AutomaticControl, {}, "period", "period", 1, PERIOD),
    (Backlash, {}, "max_backlash", "max_backlash", 1, 2**20),
    (Limits, {"period": 1}, "axes", "axes", 1, 64),
    (Limits, {"axes": 1}, "period", "limits period", 1, PERIOD),
    (ManualControl, {}, "period", "jog_period", 1, PERIOD),
    (MotionSequencer, {}, "z_travel", "z_travel", 1, 2**15),
    (MoveTo, {}, "width", "width", 2, 64),
    (NumericalController, STEPS, "period", "period", 1, PERIOD),
    (NumericalController, STEPS, "jog_period", "jog_period", 1, PERIOD),
    (NumericalController, STEPS, "z_travel", "z_travel", 1, 2**15),
    (OrderControl, {}, "period", "period", 1, PERIOD),
    (OrderLedger, {}, "depth", "depth", 2, 16),
    (PointStore, {}, "points", "points", 1, 1023),
    (PointStore, {}, "axes", "axes", 1, 8),
    (PointStore, {}, "width", "width", 2, 64),
    (SpiralWalk, {"columns": 5}, "rows", "rows of the picture", 1, 512),
    (SpiralWalk, {"rows": 5}, "columns", "columns of the picture", 1, 512),
    (SquareGenerator, {}, "side", "side", 1, 65_535),
    (Debouncer, {"width": 1}, "period", "debounce period", 1, PERIOD),
    (Monitor, {}, "scan_bits", "scan_bits", 3, 24),
    (SevenSegment, {}, "scan_bits", "scan_bits", 3, 24),
    (DecimalReader, {}, "width", "width of a number", 5, 33),
    (DecimalWriter, {}, "width", "width of a number", 5, 32),
    (FixedPoint, {}, "width", "width of a value", 8, 64),
    (FixedPoint, {}, "decimals", "decimals of a value", 2, 9),
    (GCodeInterpreter, {}, "width", "width", 40, 64),
    *((part, {"reach": 2}, "width", "width", least, 64) for part, least in (
        (GCodeCoordinates, 4), (GCodeLine, 8))),
    (UnitConverter, {"reach": 2, "speed": 2}, "width", "width", 4, 64),
    *((part, {}, "reach", "reach", 2, 44) for part in (
        GCodeCoordinates, GCodeLine, UnitConverter)),
    (UnitConverter, {}, "speed", "speed", 2, 43),
    (GCodeReader, {}, "width", "width of a value", 8, 64),
    (GCodeReader, {}, "decimals", "decimals of a value", 2, 9),
    (HexReader, {}, "digits", "digits of a message", 1, 64),
    (HexWriter, {"start": b"="}, "digits", "digits of a message", 1, 64),
    (LineBuffer, {}, "depth", "depth of a line buffer", 2, 4096),
    (LineBuffer, {}, "silence", "silence", 1, PERIOD),
    (LineReader, {}, "length", "length of a line", 1, 1022),
    (UARTReceiver, {}, "period", "period", 16, PERIOD),
    (UARTTransmitter, {}, "period", "period", 16, PERIOD),
]


@pytest.mark.parametrize(("component", "made_with", "parameter", "name", "least", "most"), LIMITS)
def test_what_is_beyond_the_limits_is_named(component, made_with, parameter, name, least, most):
    for value in (least - 1, most + 1, least + 0.0):
        message = f"{name} must be a whole number from {least} to {most}, not {value!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            component(**{**made_with, parameter: value})
