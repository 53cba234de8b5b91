"""Bytes to orders and back: the serial line, lines of text, words and numbers."""

from .baud import BAUD, bit_period
from .decimal_reader import DecimalReader, NumberError
from .decimal_writer import DecimalWriter
from .fixed_point import FixedPoint, fixed_point_layout
from .frames import FrameInterpreter
from .gcode_coordinates import CoordinateSum, GCodeCoordinates, Operand
from .gcode_gate import GCodeGate
from .gcode_interpreter import GCodeAction, GCodeActionKind, GCodeInterpreter
from .gcode_line import GCodeLine
from .gcode_lister import LISTED, GCodeList, GCodeLister, GCodeText
from .gcode_modes import GCodeLineState, GCodeModes, GCodeMotion
from .gcode_reader import GCodeKind, GCodeReader, GCodeStatus, gcode_layout
from .gcode_reporter import GCodeMessage, GCodeReporter, GCodeState, ReportNumber
from .gcode_settings import (
    MAX_WIDTH,
    NEVER_IDLE,
    SETTING_BITS,
    SETTINGS,
    GCodeFlags,
    GCodeSettingStore,
    setting_index,
    setting_values,
)
from .hex_reader import CHECK_DIGITS, HexReader
from .hex_writer import HexWriter
from .line import LineEnd, LineItem, LineReader
from .line_buffer import MAX_SILENCE, LineBuffer
from .realtime import RealtimeCode, RealtimeFilter
from .receiver import Received, UARTReceiver
from .reporter import Reporter
from .stored_lines import STARTUP_LINES, STORED_LENGTH, StoredLines
from .stored_program import StoredProgram
from .text import TextSource
from .thesis import ThesisDialect
from .transmitter import UARTTransmitter
from .unit_converter import GCodeDivision, GCodeUnit, UnitConverter
from .wall_dialect import MAX_MM, HomingStage, WallDialect, wall_texts
from .words import WordReader

__all__ = [
    "BAUD", "CHECK_DIGITS", "LISTED", "MAX_MM", "MAX_SILENCE", "MAX_WIDTH", "NEVER_IDLE",
    "SETTINGS", "SETTING_BITS", "STARTUP_LINES", "STORED_LENGTH", "CoordinateSum", "DecimalReader",
    "DecimalWriter", "FixedPoint", "FrameInterpreter", "GCodeAction", "GCodeActionKind",
    "GCodeCoordinates", "GCodeDivision", "GCodeFlags", "GCodeGate", "GCodeInterpreter", "GCodeKind",
    "GCodeLine", "GCodeLineState", "GCodeList", "GCodeLister", "GCodeMessage", "GCodeModes",
    "GCodeMotion", "GCodeReader", "GCodeReporter", "GCodeSettingStore", "GCodeState", "GCodeStatus",
    "GCodeText", "GCodeUnit", "HexReader", "HexWriter", "HomingStage", "LineBuffer", "LineEnd",
    "LineItem", "LineReader", "NumberError", "Operand", "RealtimeCode", "RealtimeFilter",
    "Received", "ReportNumber", "Reporter", "StoredLines", "StoredProgram", "TextSource",
    "ThesisDialect", "UARTReceiver", "UARTTransmitter", "UnitConverter", "WallDialect",
    "WordReader", "bit_period", "fixed_point_layout", "gcode_layout", "setting_index",
    "setting_values", "wall_texts",
]
