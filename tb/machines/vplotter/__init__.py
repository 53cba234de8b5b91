"""`vplotter`: a pen that hangs from two strings, over a serial line."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from fresa.arithmetic.line import LEAST_CLOCK
from fresa.machines.vplotter import VPlotter, VPlotterSettings
from fresa.motion import MAX_BLOCKS
from fresa.protocol import MAX_MM

from ...diagram import Diagram
from ...gcode_options import read_number, read_others, read_program, read_startup
from ...machine import Coverage, Machine, Option, Options, Recorded, Serve, parts

__all__ = ["MACHINE", "SHORT"]

DEFAULT = VPlotterSettings()


def _directed(seed: int, clocks: int, *, settings: VPlotterSettings):
    from .stimulus import directed

    return directed(settings, seed, clocks)


def _random(seed: int, block: int, rows: int, *, settings: VPlotterSettings):
    from .stimulus import random_rows

    return random_rows(settings, seed, block, rows)


def _explore(engine) -> None:
    from .explore import explore

    explore(engine)


def _real(clock: int, *, wall: tuple[int, int], least_y: int, rest: tuple[int, int],
          string_steps: str, rate: str, acceleration: str, deviation: str, settings: str,
          program: str, startup: Sequence[str], **values: Any):
    speed, change = read_number("--rate", rate), read_number("--acceleration", acceleration)
    made = VPlotterSettings(
        clock=clock, wall_width=wall[0], wall_height=wall[1], least_y=least_y, rest=rest,
        string_steps=read_number("--string-steps", string_steps),
        max_rate=(speed, speed, DEFAULT.max_rate[2]),
        acceleration=(change, change, DEFAULT.acceleration[2]),
        deviation=read_number("--deviation", deviation), others=read_others(settings),
        **values)
    first = read_startup(startup, "grbl", probing=False, steps_per_mm=made.steps_per_mm)
    return {"settings": replace(made, startup=first, program=read_program(
        program, "grbl", startup=first, probing=False, steps_per_mm=made.steps_per_mm))}


def _figures(clock: int, made: Options, **values: Any):
    settings: VPlotterSettings = made["settings"]
    fastest = float(settings.max_rate[0])
    return {**values, "clock": clock, "ticks_per_mm": float(settings.steps_per_mm[0])}, (
        f"clock {clock / 1e6:g} MHz; {settings.line_baud} baud; wall of {settings.wall_width} mm "
        f"by {settings.wall_height}, up to {fastest:g} mm/min; {settings.depth} blocks of "
        "look-ahead")


def _plant(*, settings: VPlotterSettings):
    """Return what hangs there, at the place of rest at first."""
    from ...wall_plant import WallPlant

    return WallPlant(settings.wall_width, settings.steps_of_string,
                     *settings.rest, switch_mm=SWITCH_MM, period=settings.period)


SWITCH_MM = 5
"""Millimetres of string in which an end switch is on."""

OPTIONS = (
    Option("baud", "bits a second of the serial line (default: %(default)s)", DEFAULT.baud,
           least=1, metavar="N"),
    Option("wall", "from pulley to pulley, and from their line to the lower edge of the wall, in "
           "mm (default: 1768 1768)", (DEFAULT.wall_width, DEFAULT.wall_height), least=10,
           most=MAX_MM, metavar=("WIDTH", "HEIGHT"), serve=True),
    Option("least_y", "upper edge of where it draws, in mm below the line of the pulleys (default: "
           "%(default)s)", DEFAULT.least_y, least=1, most=MAX_MM, metavar="MM", serve=True),
    Option("rest", "where it is after homing, in mm from the left pulley, y down (default: "
           "884 884)", DEFAULT.rest, least=0, most=MAX_MM, metavar=("X", "Y"), serve=True),
    Option("string_steps", "half steps of a motor per mm of string (default: %(default)s)",
           "25.4648", metavar="N", serve=True),
    Option("string_rate", "half steps a second with which homing winds the strings, and with which "
           "--bowed draws (default: %(default)s)", DEFAULT.string_rate, least=1, metavar="N",
           serve=True),
    Option("bowed", "draw :F as the thesis: each string at a constant speed, --string-rate the "
           "faster one, so that the line is bowed", False, serve=True),
    Option("rate", "highest speed of the pen in X and in Y, in mm/min (default: %(default)s)",
           "3000", metavar="N", serve=True),
    Option("acceleration", "of the pen in X and in Y, in mm/s² (default: %(default)s)", "100",
           metavar="N", serve=True),
    Option("deviation", "junction deviation in mm, $11: how far a corner may be cut to be passed "
           "without a stop; it is not cut (default: %(default)s)", "0.01", metavar="MM",
           serve=True),
    Option("settings", "further settings by the numbers of GRBL, such as 3=1,13=1: see "
           "docs/gcode.md (default: none)", "", metavar="N=V,...", serve=True),
    Option("startup", "lines that are run at every start until $N0= and $N1= change them, such as "
           "'G21 G90' '' (default: none)", ("", ""), metavar=("LINE", "LINE"), serve=True),
    Option("program", "a file of G-code that goes into the bitstream, for the start button to run "
           "(default: none)", "", metavar="FILE", serve=True),
    Option("depth", "blocks that are looked ahead, a power of two (default: %(default)s)",
           DEFAULT.depth, least=4, most=MAX_BLOCKS, metavar="N"),
)

SHORT = VPlotterSettings(
    clock=2_000_000, baud=125_000, wall_width=16, wall_height=16, least_y=3, rest=(8, 8),
    string_steps=Fraction(4), string_rate=7000, max_rate=(Fraction(60_000),) * 3,
    acceleration=(Fraction(17_000),) * 3,
    deviation=Fraction(1, 10), others=((210, Fraction(100)), (211, Fraction(300))))
"""A small wall with coarse strings, so that a session is short."""

DIAGRAMS = (
    Diagram(
        "vplotter",
        "A line of G-code is there, the pen touches, and the strings begin to move.",
        "line: rx tx outputs: pen moving left right", 36_000, 48_000),
)

PARTS = ("string_motor", "string_length", "hanging", "bowed_line", "string_homing",
         "string_cycles", "wall_dialect")
"""Those of its components that have a bench and that no other machine has."""

MACHINE = Machine(
    name="vplotter", order=4,
    about="a pen that hangs from two strings: G-code, or the thesis' commands (docs/vplotter.md)",
    make=VPlotter,
    short={"settings": SHORT},
    variants={"vplotter-bowed": {"settings": replace(SHORT, bowed=True)}},
    directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    options=OPTIONS, real=_real, figures=_figures,
    serve=Serve("a hanging plotter; commands such as  :H  or  :I05000500  and Return, or G-code",
                switches=lambda **options: ("L-", "R-"), plant=_plant,
                contacts=("stop", "door", "hold", "start", "abort", "motor_fault"),
                baud=9600, least_clock=LEAST_CLOCK),
    diagrams=DIAGRAMS,
    coverage=Coverage(100_000, 85, 55, _explore, named=True),
    recorded=Recorded(benchmarks={"lines": ("benchmarks.wall_lines",
                                            "benchmarks.wall_lines --lines 300 --motors 10")},
                      faults={"resets": (10_000, 1000), "flips": (4000, 300)},
                      unmutated="The parts of `vplotter` are mutated one by one, not the machine.",
                      mutated=PARTS,
                      mutants_least=90, quick_mutants="string_homing"),
    **parts(__name__, "faults", "fuzz", "modelled", "netlist", "scenarios"))
