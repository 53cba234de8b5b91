"""Bytes to orders and back: the serial line, lines of text, words and numbers."""

from .baud import bit_period
from .receiver import Received, UARTReceiver
from .transmitter import UARTTransmitter

__all__ = ["Received", "UARTReceiver", "UARTTransmitter", "bit_period"]
