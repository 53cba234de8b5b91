"""`gcode`: three axes that are programmed in G-code, over a serial line."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from fresa.arithmetic.line import LEAST_CLOCK
from fresa.drive.spindle import MAX_PWM
from fresa.machines.gcode import AXES, AXIS_NAMES, BAUDS, GCode, GCodeSettings
from fresa.motion import KINEMATICS, MAX_BLOCKS

from ...diagram import Diagram
from ...engines import Engine
from ...gcode_options import read_number, read_others, read_program, read_startup
from ...machine import Coverage, Machine, Option, Options, Recorded, Serve, parts

__all__ = ["MACHINE"]


def _directed(seed: int, clocks: int, *, settings: GCodeSettings):
    from .stimulus import directed

    return directed(settings, seed, clocks)


def _random(seed: int, block: int, rows: int, *, settings: GCodeSettings):
    from .stimulus import random_rows

    return random_rows(settings, seed, block, rows)


def _explore(engine: Engine) -> None:
    from .explore import explore

    explore(engine)


def _real(clock: int, *, steps: Sequence[str], rate: Sequence[str], acceleration: Sequence[str],
          deviation: str, settings: str, program: str, kinematics: str,
          second_motor: str | None, dialect: str, probing: str | None, startup: Sequence[str],
          startup_lines: str | None, single_axes: str | None, **values: int):
    each = {name: tuple(read_number(f"--{name}", text) for text in texts)
            for name, texts in (("steps", steps), ("rate", rate), ("acceleration", acceleration))}
    probes = probing != "no"
    first = read_startup(startup, dialect, probing=probes, steps_per_mm=each["steps"])
    return {"settings": GCodeSettings(
        clock=clock, steps_per_mm=each["steps"], max_rate=each["rate"],
        acceleration=each["acceleration"], deviation=read_number("--deviation", deviation),
        others=read_others(settings), kinematics=kinematics, second_motor=second_motor,
        program=read_program(program, dialect, startup=first, probing=probes,
                             steps_per_mm=each["steps"]),
        dialect=dialect, probing=probes, startup=first, startup_lines=startup_lines != "no",
        single_axes=single_axes != "no",
        **values)}


def _inverted(**options: Any):
    return ["enable"]  # a driver module is on where its ENABLE is low


def _figures(clock: int, made: Options, **values: Any):
    settings: GCodeSettings = made["settings"]
    fastest = max(float(rate * steps) / 60 for rate, steps in zip(
        settings.max_rate, settings.steps_per_mm, strict=True))
    return {**values, "clock": clock, "probing": settings.probes,
            "startup_lines": settings.stores, "single_axes": settings.homes_one,
            "most_steps_per_s": round(fastest)}, (
        f"clock {clock / 1e6:g} MHz; {settings.line_baud} baud; up to {fastest:.0f} steps/s; "
        f"{settings.depth} blocks of look-ahead")


def _second_switch(*, second_motor: str | None, **options: Any):
    return {f"{second_motor.upper()}2-": "second_limit"} if second_motor else {}


SMALL = ("nexys2-500",)
"""Boards whose FPGA holds it only without probing, startup lines, and homing of single axes."""

OPTIONS = (
    Option("dialect", "what its lines are: those of GRBL 1.1, or those of the thesis' firmware, "
           "see docs/gcode.md (default: %(default)s)", "grbl", choices=tuple(BAUDS), serve=True),
    Option("baud", "bits a second of the serial line (default: "
           f"{', '.join(f'{baud} with {dialect}' for dialect, baud in BAUDS.items())})", None,
           least=1, metavar="N"),
    Option("steps", "steps per mm of each axis, $100 to $102 of GRBL (default: 250 250 250)",
           ("250",) * AXES, metavar=("X", "Y", "Z"), serve=True),
    Option("rate", "highest speed of each axis in mm/min, $110 to $112 (default: 500 500 500)",
           ("500",) * AXES, metavar=("X", "Y", "Z"), serve=True),
    Option("acceleration", "of each axis in mm/s², $120 to $122 (default: 10 10 10)",
           ("10",) * AXES, metavar=("X", "Y", "Z"), serve=True),
    Option("deviation", "junction deviation in mm, $11: how far a corner may be cut to be passed "
           "without a stop; it is not cut (default: %(default)s)", "0.01", metavar="MM",
           serve=True),
    Option("settings", "further settings by the numbers of GRBL, such as 22=1,23=3,130=300: see "
           "docs/gcode.md (default: none)", "", metavar="N=V,...", serve=True),
    Option("pwm_hz", "frequency of the PWM of the spindle (default: %(default)s)",
           GCodeSettings.pwm_hz, least=1, most=MAX_PWM, metavar="HZ"),
    Option("kinematics", "what the motors of X and Y move: an axis each, or both of them by belts, "
           "A = X + Y and B = X - Y (default: %(default)s)", "cartesian",
           choices=tuple(KINEMATICS), serve=True),
    Option("second_motor", "axis that has a second motor with a limit switch, as a gantry may have "
           "one, which homing squares (default: none)", None, choices=AXIS_NAMES, serve=True),
    Option("probing", "G38.2 to G38.5; without them it is smaller (default: yes, but "
           f"no on {' and '.join(SMALL)})", None, choices=("yes", "no"), serve=True),
    Option("startup", "lines that are run at every start until $N0= and $N1= change them, such as "
           "'G21 G90' '' (default: none)", ("", ""), metavar=("LINE", "LINE"), serve=True),
    Option("startup_lines", "$N0= and $N1=, and the text of $I=; without them it is smaller "
           f"(default: yes, but no on {' and '.join(SMALL)})", None, choices=("yes", "no"),
           serve=True),
    Option("single_axes", "$HX, $HY and $HZ, which home one axis; without them it is smaller "
           f"(default: yes, but no on {' and '.join(SMALL)})", None, choices=("yes", "no"),
           serve=True),
    Option("program", "a file of G-code that goes into the bitstream, for the start button to run "
           "(default: none)", "", metavar="FILE", serve=True),
    *(Option(name, f"least time for which {says} (default: %(default)s)", time, least=1,
             metavar="NS")
      for name, time, says in (
          ("width_ns", GCodeSettings.width_ns, "STEP is high"),
          ("low_ns", GCodeSettings.low_ns, "STEP is low"),
          ("setup_ns", GCodeSettings.setup_ns, "DIR is still before STEP"),
          ("hold_ns", GCodeSettings.hold_ns, "DIR is still after STEP"))),
    Option("depth", "blocks that are looked ahead, a power of two (default: %(default)s)",
           GCodeSettings.depth, least=4, most=MAX_BLOCKS, metavar="N"),
)

SHORT = GCodeSettings(
    clock=2_000_000, baud=125_000, steps_per_mm=(Fraction(80),) * AXES,
    max_rate=(Fraction(12_000),) * AXES, acceleration=(Fraction(16_000),) * AXES)

SHORT_THESIS = replace(
    SHORT, dialect="thesis", steps_per_mm=(Fraction(10_000),) * AXES,
    max_rate=(Fraction(1_500),) * AXES,
    others=((25, Fraction(300)), (130, Fraction(1)), (131, Fraction(1)), (201, Fraction(1)),
            (210, Fraction(100)), (211, Fraction(300))),
    silence_us=500, idle_us=600, servo_us=500)
"""That of the thesis: steps are fine, and times are a tenth or less, so that a session is short."""

SHORT_GANTRY = replace(
    SHORT, second_motor="z",
    others=((24, Fraction(6_000)), (25, Fraction(6_000)), (27, Fraction(1, 20)),
            *((axis, Fraction(1)) for axis in (130, 131, 132))))
"""With a second motor on Z, which is the first axis to home; its travel is a mm, so that this is
short."""

PARTS = (
    "root", "profile", "plan", "nominal_speed", "step_accumulator", "step_ratio", "rotator", "walk",
    "block_loader", "overrides", "accessory_restart", "step_dir_pair", "pending", "squaring",
    "backlash_compensator", "core_xy", "gcode_homing", "gcode_probing", "gcode_control", "realtime",
    "line_buffer", "contact_filter", "fixed_point", "gcode_reader", "gcode_gate", "gcode_line",
    "gcode_lister", "gcode_reporter", "gcode_settings", "spindle_power", "power_pwm", "servo_pulse",
    "stored_lines", "stored_program", "thesis", "gcode_coordinates", "unit_converter",
    "arithmetic_unit", "formulas")
"""Those of its components that have a bench and that neither mill, single nor positioner has."""

DIAGRAMS = (
    Diagram(
        "gcode",
        "A line of G-code has been read, `ok` begins, and the first steps are made.",
        "line: rx tx outputs: moving enable step direction", 7_600, 14_000),
    Diagram(
        "gcode-thesis",
        "In the dialect of the thesis: `start`, then `G28`, with which the motors go on.",
        "line: rx tx outputs: moving enable servo step direction", 0, 12_000),
)

MACHINE = Machine(
    name="gcode", order=3,
    about="a CNC controller: G-code on the serial line, three axes (docs/gcode.md)",
    make=GCode,
    short={"settings": SHORT},
    variants={"gcode-gantry": {"settings": SHORT_GANTRY}},
    directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    options=OPTIONS, real=_real, inverted=_inverted, figures=_figures,
    on_boards=dict.fromkeys(SMALL, {"probing": "no", "startup_lines": "no", "single_axes": "no"}),
    serve=Serve("three axes; G-code such as  G1 X10 F300  and Return,  ?  for the state",
                switches=lambda **options: ("X-", "Y-", "Z-"), further_switches=_second_switch,
                contacts=("stop", "door", "hold", "start", "abort", "probe", "motor_fault"),
                baud=BAUDS["grbl"], least_clock=LEAST_CLOCK),
    diagrams=DIAGRAMS,
    # Places have room for metres, and a run goes millimetres; long lists are left out.
    coverage=Coverage(100_000, 89, 66, _explore, named=True),
    recorded=Recorded(benchmarks={
        "instants": ("benchmarks.step_times --steps 1000 --programs 60",
                     "benchmarks.step_times --steps 50 --programs 2"),
        "ends": ("benchmarks.end_positions --blocks 1000000 --gateware 100000",
                 "benchmarks.end_positions --blocks 10000 --gateware 500"),
        "limits": ("benchmarks.limits --programs 32",
                   "benchmarks.limits arcs corners --programs 2"),
        "reach": ("benchmarks.gcode --blocks 10000", "benchmarks.gcode --blocks 100 --stops 3"),
        "planning": ("benchmarks.planning --segments 100000",
                     "benchmarks.planning --segments 400"),
        "arcs": ("benchmarks.arcs --arcs 2000", "benchmarks.arcs --turns 10000"),
        "load": ("benchmarks.load --seconds 60", "benchmarks.load --seconds 2"),
        "hour": ("benchmarks.load --seconds 0 --model-hours 1", "")},
                      of_models=["instants", "planning", "arcs", "hour"],
                      sizes={"gcode": ("", "netlist nexys2-gcode")},
                      faults={"resets": (10_000, 1000), "flips": (4000, 300)},
                      unmutated="The parts of `gcode` are mutated one by one, not the machine.",
                      mutated=PARTS,
                      mutants_least=95, quick_mutants="overrides"),
    **parts(__name__, "faults", "fuzz", "modelled", "netlist", "scenarios"))
