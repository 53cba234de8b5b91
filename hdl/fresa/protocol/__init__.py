"""Bytes to orders and back: the serial line, lines of text, words and numbers."""

from .baud import bit_period
from .line import LineEnd, LineItem, LineReader
from .receiver import Received, UARTReceiver
from .transmitter import UARTTransmitter

__all__ = [
    "LineEnd", "LineItem", "LineReader", "Received",
    "UARTReceiver", "UARTTransmitter", "bit_period",
]
