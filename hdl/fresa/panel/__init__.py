"""People: switches and buttons in, LEDs and the display out."""

from .debounce import Debouncer, debounce_period
from .display import SevenSegment, scan_bits
from .glitch import GlitchFilter
from .monitor import Monitor

__all__ = ["Debouncer", "GlitchFilter", "Monitor", "SevenSegment", "debounce_period", "scan_bits"]
