"""People: switches and buttons in, LEDs and the display out."""

from .contact_filter import ContactFilter
from .debounce import Debouncer, debounce_period
from .display import SevenSegment, scan_bits
from .glitch import GlitchFilter
from .monitor import Monitor

__all__ = ["ContactFilter", "Debouncer", "GlitchFilter", "Monitor", "SevenSegment",
           "debounce_period", "scan_bits"]
