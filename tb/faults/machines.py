# amaranth: UnusedElaboratable=no

"""The machines that can be struck, each with every time shortened."""

from collections.abc import Callable
from itertools import islice

import numpy as np

from fresa.machines import Positioner, Single
from fresa.machines.mill import MillTiming
from fresa.machines.positioner import PositionerTiming
from fresa.machines.single import SingleTiming

from .. import boards
from ..design import Design
from ..fuzz import targets
from ..fuzz.inputs import random_inputs
from ..fuzz.switches import press_switches, switch_levels
from ..machines.mill.stimulus import orders, random_rows
from ..machines.single.fuzz.session import PHASES
from ..plant import WORDS
from .rows import Rows, rows_of_stimulus
from .sessions import (
    BIT,
    positioner_question,
    positioner_sessions,
    positioner_work,
    single_question,
    single_sessions,
    single_work,
)
from .target import Coils, FaultTarget, Line, Pulses
from .work import actions, rows_of_actions

__all__ = ["MACHINES", "TIMING", "TRAVEL", "mill", "positioner", "single"]

TIMING = MillTiming(period=4, scan_bits=3)
TRAVEL = 6
"""Of the mill: so that much happens in few clocks."""

OF_MEMORIES = "lines.items__payload", "texts.fetch__data", "points.read__data"
"""Registers that memories have at their outputs: block RAM gives something in every clock."""


def mill(*, guard: bool) -> FaultTarget:
    """Give the raw mill.

    A reset does not set where its motors stand, how long ago they stepped, and that `start` has
    been taken; and of the guard what it must remember over a reset.
    """
    design = boards.mill(timing=TIMING, z_travel=TRAVEL, guard=guard)
    main = "main " if guard else ""

    def to_reset(seed: int, number: int) -> Rows:
        """Orders that wait for the machine in one chunk, pins at random in the next."""
        if number % 2:
            return rows_of_stimulus(random_rows(seed, number, 40_000), design.inputs)
        return rows_of_actions(islice(orders(seed * 1_000_003 + number), 200))

    return FaultTarget(
        "mill", design, tuple(Coils(axis, f"controller {main}automatic {axis} count",
                                    f"axis_{axis}", WORDS) for axis in "xyz"),
        idle=("ready", 1), fault="error", origin={"rst": 1, "mode": 0},
        kept=("black", "orange", "rest", "started", "fault", "seen", "apart_x_before",
              "apart_y_before", "apart_z_before"),
        work=lambda seed: rows_of_actions(actions(seed, 150)), work_to_reset=to_reset,
        gap=120, window=400, timeout=2000, ignored=("monitor.",), guard=guard)


def single() -> FaultTarget:
    """Give `single`.

    A reset does not set the row and the coils of its motor, and the times since the last step; nor
    what its memories gave last, which nothing asks for before it is given anew.
    """
    timing = SingleTiming.real(clock=48_000, baud=3000)
    assert timing.bit == BIT
    design = boards.component("single", Single(timing=timing, greeting=b"!\r\n",
                                               help_text=b"?\r\n"))
    return FaultTarget(
        "single", design,
        (Coils("the motor", "move position", "coils", PHASES, "enable"),),
        idle=("moving", 0), fault="fault", origin={"rst": 1},
        kept=("driver.row", "driver.coils", "driver.rest", "accumulator", *OF_MEMORIES),
        work=lambda seed: single_work(seed, 30),
        work_to_reset=_to_reset(design, single_sessions),
        gap=6000, window=6000, timeout=20_000, line=Line(BIT, b"oe", single_question()))


def positioner() -> FaultTarget:
    """Give the positioner, with the lowest of clocks.

    A reset does not set the pins of its driver modules and the timers of these; the times since the
    last step, nor which way it went, and what play there is still to take up; the switches as they
    were seen; nor what its memories gave last, which nothing asks for before it is given anew.
    """
    timing = PositionerTiming(clock=100 * BIT, baud=100, top_speed=200, width=2, low=3, setup=2,
                              hold=4,
                          settle=30, report=20_000)
    design = boards.component("positioner", Positioner(timing=timing))
    times = timing.width, timing.low, timing.setup, timing.hold
    return FaultTarget(
        "positioner", design,
        tuple(Pulses(name, f"{name} move position", bit, times) for bit, name in enumerate("xyz")),
        idle=("moving", 0), fault="fault", origin={"rst": 1},
        kept=("driver.step_pin", "driver.direction_pin", "driver.enable_pin", "driver.wait",
              "accumulator",
              "backlash.way", "backlash.left", "limits.since", "limits.before",
              "limits.divider.count", *OF_MEMORIES),
        work=lambda seed: positioner_work(seed, 20),
        work_to_reset=_to_reset(design, positioner_sessions),
        gap=12_000, window=12_000, timeout=20_000, line=Line(BIT, b"!", positioner_question()))


def _to_reset(design: Design, sessions: Callable[[int], Rows]) -> Callable[[int, int], Rows]:
    """Sessions that soon move the motors in one chunk, anything at all in the next."""
    target = targets()[design.name]

    def work(seed: int, number: int) -> Rows:
        own = seed * 1_000_003 + number
        if number % 2 == 0:
            return sessions(own)
        sent = random_inputs(target.protocol, own, 2000, BIT)
        if target.switches:
            sent = press_switches(sent, target.switches[1], own, BIT)
        sent = list(sent)
        rx = np.concatenate([item.levels for item in sent])
        return rows_of_stimulus({"rst": np.zeros_like(rx), "rx": rx, "limits": switch_levels(sent)},
                                design.inputs)
    return work


MACHINES: dict[str, Callable[..., FaultTarget]] = {
    "mill": mill, "single": single, "positioner": positioner}
"""Each by its name. The mill is made with its guard or without."""
