"""People: switches and buttons in, LEDs and the display out."""

from .debounce import Debouncer
from .display import SevenSegment
from .monitor import Monitor

__all__ = ["Debouncer", "Monitor", "SevenSegment"]
