"""Bytes to orders and back: the serial line, lines of text, words and numbers."""

from .baud import BAUD, bit_period
from .decimal_reader import DecimalReader, NumberError
from .decimal_writer import DecimalWriter
from .frames import FrameInterpreter
from .hex_reader import CHECK_DIGITS, HexReader
from .hex_writer import HexWriter
from .line import LineEnd, LineItem, LineReader
from .receiver import Received, UARTReceiver
from .reporter import Reporter
from .text import TextSource
from .transmitter import UARTTransmitter
from .words import WordReader

__all__ = [
    "BAUD", "CHECK_DIGITS", "DecimalReader", "DecimalWriter", "FrameInterpreter",
    "HexReader", "HexWriter", "LineEnd", "LineItem", "LineReader",
    "NumberError", "Received", "Reporter", "TextSource",
    "UARTReceiver", "UARTTransmitter", "WordReader", "bit_period",
]
