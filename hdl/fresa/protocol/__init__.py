"""Bytes to orders and back: the serial line, lines of text, words and numbers."""

from .baud import BAUD, bit_period
from .decimal_reader import DecimalReader, NumberError
from .decimal_writer import DecimalWriter
from .fixed_point import FixedPoint, fixed_point_layout
from .frames import FrameInterpreter
from .gcode_reader import GCodeKind, GCodeReader, GCodeStatus, gcode_layout
from .hex_reader import CHECK_DIGITS, HexReader
from .hex_writer import HexWriter
from .line import LineEnd, LineItem, LineReader
from .line_buffer import LineBuffer
from .realtime import RealtimeCode, RealtimeFilter
from .receiver import Received, UARTReceiver
from .reporter import Reporter
from .text import TextSource
from .transmitter import UARTTransmitter
from .words import WordReader

__all__ = [
    "BAUD", "CHECK_DIGITS", "DecimalReader", "DecimalWriter", "FixedPoint", "FrameInterpreter",
    "GCodeKind", "GCodeReader", "GCodeStatus", "HexReader", "HexWriter", "LineBuffer", "LineEnd",
    "LineItem", "LineReader", "NumberError", "RealtimeCode", "RealtimeFilter", "Received",
    "Reporter", "TextSource", "UARTReceiver", "UARTTransmitter", "WordReader", "bit_period",
    "fixed_point_layout", "gcode_layout",
]
