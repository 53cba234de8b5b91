"""Contracts of the components that machines are made of, to be proved by `tools.prove`."""

from .accessory_restart import ACCESSORY_RESTART
from .arithmetic_unit import ARITHMETIC_UNIT
from .automatic import AUTOMATIC
from .axes import AXES
from .axis import AXIS
from .backlash import BACKLASH
from .backlash_compensator import BACKLASH_COMPENSATOR
from .block_loader import BLOCK_LOADER
from .block_motion import BLOCK_MOTION
from .bowed_line import BOWED_LINE
from .coil import COIL
from .contract import Component
from .controller import CONTROLLER
from .coordinates import COORDINATES
from .counter import COUNTER
from .debounce import DEBOUNCE
from .decimal_reader import DECIMAL_READER
from .decimal_writer import DECIMAL_WRITER
from .display import DISPLAY
from .divider import DIVIDER
from .fixed_point import FIXED_POINT
from .formulas import FORMULAS
from .gcode_control import GCODE_CONTROL
from .gcode_coordinates import GCODE_COORDINATES
from .gcode_gate import GCODE_GATE
from .gcode_homing import GCODE_HOMING
from .gcode_interpreter import GCODE_INTERPRETER
from .gcode_line import GCODE_LINE
from .gcode_lister import GCODE_LISTER
from .gcode_planner import GCODE_PLANNER
from .gcode_probing import GCODE_PROBING
from .gcode_reader import GCODE_READER
from .gcode_reporter import GCODE_REPORTER
from .gcode_settings import GCODE_SETTINGS
from .glitch import CONTACT_FILTER, GLITCH
from .guard import GUARD
from .hanging import HANGING
from .hex_digits import HEX_READER, HEX_WRITER
from .kinematics import CORE_XY
from .limits import LIMITS
from .line import LINE
from .line_buffer import LINE_BUFFER
from .manual import MANUAL
from .monitor import MONITOR
from .nominal import NOMINAL_SPEED
from .order_control import ORDER_CONTROL
from .order_ledger import ORDER_LEDGER
from .overrides import OVERRIDES
from .pending import PENDING
from .phase import PHASE
from .plan import PLAN
from .points import POINTS
from .position import POSITION
from .profile import PROFILE
from .ramp import RAMP
from .rate import RATE
from .realtime import REALTIME
from .root import ROOT
from .rotator import ROTATOR
from .search import SEARCH
from .sequencer import SEQUENCER
from .spindle import SPINDLE_POWER
from .spindle_pulses import POWER_PWM, SERVO_PULSE
from .spiral import SPIRAL
from .square import SQUARE
from .squaring import SQUARING
from .start import START
from .step_accumulator import STEP_ACCUMULATOR
from .step_dir import STEP_DIR
from .step_dir_pair import STEP_DIR_PAIR
from .step_ratio import STEP_RATIO
from .stored_lines import STORED_LINES
from .stored_program import STORED_PROGRAM
from .string_cycles import STRING_CYCLES
from .string_homing import STRING_HOMING
from .string_length import STRING_LENGTH
from .string_motor import STRING_MOTOR
from .text import TEXT
from .thesis import THESIS
from .uart_receiver import UART_RECEIVER
from .uart_transmitter import UART_TRANSMITTER
from .unit_converter import UNIT_CONVERTER
from .walk import WALK
from .wall_dialect import WALL_DIALECT
from .words import WORDS

__all__ = ["GENERAL", "Component"]

GENERAL = {
    "divider": DIVIDER,
    "coil": COIL,
    "counter": COUNTER,
    "axes": AXES,
    "phase": PHASE,
    "step_dir": STEP_DIR,
    "step_dir_pair": STEP_DIR_PAIR,
    "pending": PENDING,
    "string_motor": STRING_MOTOR,
    "rate": RATE,
    "position": POSITION,
    "ramp": RAMP,
    "root": ROOT,
    "profile": PROFILE,
    "arithmetic_unit": ARITHMETIC_UNIT,
    "formulas": FORMULAS,
    "backlash": BACKLASH,
    "backlash_compensator": BACKLASH_COMPENSATOR,
    "core_xy": CORE_XY,
    "string_length": STRING_LENGTH,
    "hanging": HANGING,
    "limits": LIMITS,
    "axis": AXIS,
    "plan": PLAN,
    "points": POINTS,
    "nominal_speed": NOMINAL_SPEED,
    "order_control": ORDER_CONTROL,
    "automatic": AUTOMATIC,
    "sequencer": SEQUENCER,
    "manual": MANUAL,
    "controller": CONTROLLER,
    "guard": GUARD,
    "start": START,
    "spiral": SPIRAL,
    "coordinates": COORDINATES,
    "search": SEARCH,
    "square": SQUARE,
    "squaring": SQUARING,
    "step_accumulator": STEP_ACCUMULATOR,
    "step_ratio": STEP_RATIO,
    "rotator": ROTATOR,
    "walk": WALK,
    "block_loader": BLOCK_LOADER,
    "block_motion": BLOCK_MOTION,
    "overrides": OVERRIDES,
    "accessory_restart": ACCESSORY_RESTART,
    "gcode_planner": GCODE_PLANNER,
    "gcode_homing": GCODE_HOMING,
    "bowed_line": BOWED_LINE,
    "string_homing": STRING_HOMING,
    "string_cycles": STRING_CYCLES,
    "gcode_probing": GCODE_PROBING,
    "gcode_control": GCODE_CONTROL,
    "order_ledger": ORDER_LEDGER,
    "debounce": DEBOUNCE,
    "contact_filter": CONTACT_FILTER,
    "glitch": GLITCH,
    "display": DISPLAY,
    "monitor": MONITOR,
    "uart_receiver": UART_RECEIVER,
    "uart_transmitter": UART_TRANSMITTER,
    "line": LINE,
    "realtime": REALTIME,
    "line_buffer": LINE_BUFFER,
    "words": WORDS,
    "decimal_reader": DECIMAL_READER,
    "decimal_writer": DECIMAL_WRITER,
    "fixed_point": FIXED_POINT,
    "gcode_reader": GCODE_READER,
    "gcode_gate": GCODE_GATE,
    "gcode_line": GCODE_LINE,
    "gcode_lister": GCODE_LISTER,
    "gcode_reporter": GCODE_REPORTER,
    "gcode_settings": GCODE_SETTINGS,
    "spindle_power": SPINDLE_POWER,
    "power_pwm": POWER_PWM,
    "servo_pulse": SERVO_PULSE,
    "stored_lines": STORED_LINES,
    "stored_program": STORED_PROGRAM,
    "text": TEXT,
    "thesis": THESIS,
    "wall_dialect": WALL_DIALECT,
    "gcode_coordinates": GCODE_COORDINATES,
    "unit_converter": UNIT_CONVERTER,
    "gcode_interpreter": GCODE_INTERPRETER,
    "hex_reader": HEX_READER,
    "hex_writer": HEX_WRITER,
}
"""Components by name, in the order in which they are best read; a machine declares its own."""
