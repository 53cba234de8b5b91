"""People: switches and buttons in, LEDs and the display out."""

from .debounce import Debouncer, debounce_period
from .display import SevenSegment, scan_bits
from .monitor import Monitor

__all__ = ["Debouncer", "Monitor", "SevenSegment", "debounce_period", "scan_bits"]
