"""`positioner`: three motors behind a serial line."""

from typing import Any

from fresa.machines.positioner import Positioner, PositionerTiming

from ...diagram import Diagram
from ...machine import Coverage, Machine

__all__ = ["MACHINE"]


def _model(*, timing: PositionerTiming, **options: Any):
    from .model import PositionerModel

    return PositionerModel(timing=timing, bit=_bit(timing), **options)


def _directed(seed: int, clocks: int, *, timing: PositionerTiming, **options: Any):
    from .stimulus import directed

    return directed(_bit(timing), seed, clocks)


def _random(seed: int, block: int, rows: int, *, timing: PositionerTiming, **options: Any):
    from .stimulus import random_rows

    return random_rows(_bit(timing), seed, block, rows)


def _bit(timing: PositionerTiming) -> int:
    from fresa.protocol import bit_period

    return bit_period(timing.clock, timing.baud)


def _scenarios():
    from .scenarios import positioner

    return [positioner]


def _fuzz():
    from .fuzz import TARGET

    return TARGET


def _faults():
    from .faults import targets

    return targets()


MACHINE = Machine(
    name="positioner", order=2, about="three axes of a micropositioner, on a serial line",
    make=Positioner,
    short={"timing": PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3,
                                      setup=2, hold=4, settle=30, report=10_000),
           "backlash": (3, 0, 12), "limit_ends": ("X-", "Y+", "X+")},
    model=_model, directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    fuzz=_fuzz, faults=_faults,
    scenarios=_scenarios,
    diagrams=(Diagram(
        "positioner",
        "`GOTO` has come: X and Y go to (20, -6), X at 1500 steps/s and Y at 200, each DIR before "
        "its first STEP. X takes up 3 steps of backlash, which its position does not count.",
        "x: x.step_pin x.direction_pin x.move.position y: y.step_pin y.direction_pin "
        "y.move.position pins: enable moving rx", 9_480, 9_700),),
    coverage=Coverage(3_000_000, 96, 95))
