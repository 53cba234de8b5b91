"""Orders to steps: sequencers, counters, order sources."""

from .automatic import AutomaticControl
from .backlash import MAX_PLAY, Backlash
from .controller import NumericalController
from .coordinates import CoordinateGenerator
from .counter import StepCounter
from .guard import GuardedController
from .limits import Limits
from .manual import ManualControl
from .order_control import OrderControl
from .orders import Move, Order
from .position import MoveTo
from .sequencer import MotionSequencer
from .spiral import PICTURE_LIMIT, SpiralWalk
from .square import SquareGenerator
from .start import StartHandshake

__all__ = [
    "MAX_PLAY", "PICTURE_LIMIT", "AutomaticControl", "Backlash", "CoordinateGenerator",
    "GuardedController", "Limits", "ManualControl", "MotionSequencer", "Move", "MoveTo",
    "NumericalController", "Order", "OrderControl", "SpiralWalk", "SquareGenerator",
    "StartHandshake", "StepCounter",
]
