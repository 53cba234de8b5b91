"""`positioner`: three motors behind a serial line."""

from typing import Any

from fresa.machines.positioner import Positioner, PositionerTiming

from ...machine import Coverage, Machine

__all__ = ["MACHINE"]


def _model(*, timing: PositionerTiming, **options: Any):
    from ...models.positioner import PositionerModel

    return PositionerModel(timing=timing, bit=_bit(timing), **options)


def _directed(seed: int, clocks: int, *, timing: PositionerTiming, **options: Any):
    from ...desk import directed

    return directed(_bit(timing), seed, clocks)


def _random(seed: int, block: int, rows: int, *, timing: PositionerTiming, **options: Any):
    from ...desk import chance

    return chance(_bit(timing), seed, block, rows)


def _bit(timing: PositionerTiming) -> int:
    from fresa.protocol import bit_period

    return bit_period(timing.clock, timing.baud)


MACHINE = Machine(
    name="positioner", order=2, about="three axes of a micropositioner, on a serial line",
    make=Positioner,
    short={"timing": PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3,
                                      setup=2, hold=4, settle=30, report=10_000),
           "backlash": (3, 0, 12), "limit_ends": ("X-", "Y+", "X+")},
    model=_model, directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    coverage=Coverage(3_000_000, 96, 95))
