"""Orders to steps: sequencers, counters, order sources."""

from .accessory_restart import AccessoryRestart
from .automatic import AutomaticControl
from .axis import Axis
from .backlash import MAX_BACKLASH, Backlash, BacklashCompensator
from .block_loader import BlockLoader
from .block_motion import BlockMotion
from .blocks import Outputs, OverrideKind
from .bowed_line import BowedLine
from .controller import NumericalController
from .coordinates import CoordinateGenerator
from .counter import StepCounter
from .gcode_control import AlarmCode, GCodeControl
from .gcode_homing import GCodeHoming
from .gcode_planner import HOMING, GCodePlanner, HomingRequest
from .gcode_probing import GCodeProbing
from .guard import GuardedController
from .hanging import Hanging
from .kinematics import KINEMATICS, CoreXY
from .limits import Limits
from .manual import ManualControl
from .nominal import NominalSpeed
from .order_control import OrderControl
from .order_ledger import Answer, OrderLedger, Outcome, Request, RequestKind
from .orders import Move, Order
from .overrides import OVERRIDE_BITS, Overrides
from .plan import MAX_BLOCKS, BlockQueue
from .points import PointStore
from .position import MoveTo
from .profile import SpeedProfile
from .ramp import MAX_ACCELERATION, MAX_LEVELS, Ramp, ramp_rates
from .root import SquareRoot
from .rotator import Rotator
from .sequencer import MotionSequencer
from .spiral import PICTURE_LIMIT, SpiralWalk
from .square import SquareGenerator
from .squaring import MotorSquaring
from .start import StartHandshake
from .step_accumulator import StepAccumulator
from .step_ratio import StepRatio
from .string_cycles import StringCycles
from .string_homing import StringHoming
from .string_length import TICKS_LOG2, StringLength, nearest_steps
from .walk import WALK_DELAY, PathWalk, Segment

__all__ = [
    "HOMING", "KINEMATICS", "MAX_ACCELERATION", "MAX_BACKLASH", "MAX_BLOCKS", "MAX_LEVELS",
    "OVERRIDE_BITS", "PICTURE_LIMIT", "TICKS_LOG2", "WALK_DELAY", "AccessoryRestart", "AlarmCode",
    "Answer",
    "AutomaticControl", "Axis", "Backlash", "BacklashCompensator", "BlockLoader", "BlockMotion",
    "BlockQueue", "BowedLine", "CoordinateGenerator", "CoreXY", "GCodeControl", "GCodeHoming",
    "GCodePlanner", "GCodeProbing", "GuardedController", "Hanging", "HomingRequest", "Limits",
    "ManualControl",
    "MotionSequencer", "MotorSquaring", "Move", "MoveTo", "NominalSpeed", "NumericalController",
    "Order", "OrderControl", "OrderLedger", "Outcome", "Outputs", "OverrideKind", "Overrides",
    "PathWalk", "PointStore", "Ramp", "Request", "RequestKind", "Rotator", "Segment",
    "SpeedProfile", "SpiralWalk", "SquareGenerator", "SquareRoot", "StartHandshake",
    "StepAccumulator", "StepCounter", "StepRatio", "StringCycles", "StringHoming", "StringLength",
    "nearest_steps", "ramp_rates",
]
