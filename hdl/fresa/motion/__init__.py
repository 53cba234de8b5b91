"""Orders to steps: sequencers, counters, order sources."""

from .automatic import AutomaticControl
from .controller import NumericalController
from .coordinates import CoordinateGenerator
from .counter import StepCounter
from .guard import GuardedController
from .manual import ManualControl
from .order_control import OrderControl
from .orders import Move, Order
from .sequencer import MotionSequencer
from .spiral import PICTURE_LIMIT, SpiralWalk
from .square import SquareGenerator
from .start import StartHandshake

__all__ = [
    "PICTURE_LIMIT", "AutomaticControl", "CoordinateGenerator", "GuardedController",
    "ManualControl", "MotionSequencer", "Move", "NumericalController", "Order", "OrderControl",
    "SpiralWalk", "SquareGenerator", "StartHandshake", "StepCounter",
]
