"""Fault injection into the mill: its motors, what a reset keeps, and work."""

import functools
import random
from collections.abc import Iterable, Iterator
from dataclasses import astuple, replace
from itertools import islice

from fresa.machines.mill import MillTiming
from tb.faults.rows import Row, Rows, rows_of_stimulus
from tb.faults.target import Coils, FaultTarget
from tb.plant import WORDS

from . import MACHINE
from .actions import Action, Hold, Jog, Mode, Order, Reset, Select, Stop
from .model import MillInputs
from .stimulus import orders, random_rows

__all__ = ["FAULTS", "TIMING", "TRAVEL", "actions", "rows_of_actions", "target"]

TIMING = MillTiming(period=4, scan_bits=3)
TRAVEL = 6
"""Short, so that much happens in few clocks."""

REACH = 24
"""Farthest coordinate of an order, in steps."""


def target(*, guard: bool) -> FaultTarget:
    """Return the raw machine, with its guard or without, with every time shortened.

    A reset does not set where its motors stand, how long ago they stepped, and that `start` has
    been taken; and of the guard what it must remember over a reset.
    """
    design = MACHINE.design(timing=TIMING, z_travel=TRAVEL, guard=guard)
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


FAULTS = {guard: functools.partial(target, guard=guard) for guard in (False, True)}
"""Its builds for fault injection, by whether they have the guard."""


def actions(seed: int, count: int) -> Iterator[Action]:
    """Give so many pieces of work, as people and order sources do it.

    An order that is refused is followed by one that is not, and so its error is over before a
    reset or manual mode can hide another one. At the end the machine rests.
    """
    rng = random.Random(seed)

    def near() -> tuple[int, int]:
        return rng.randrange(REACH), rng.randrange(REACH)

    def clocks(most: int) -> int:
        return rng.randint(1, most)

    yield from (Reset(), Mode(1), Hold())
    for _ in range(count):
        what = rng.randrange(12)
        if what < 5:
            yield Order(*near(), start=clocks(3))
        elif what == 5:  # along a side and a diagonal, with the tool down
            side = clocks(REACH)
            yield from (Order(0, 0), Order(down=1), Order(side, 0), Order(0, side), Order(0, 0),
                        Order(up=1))
        elif what == 6:  # both refused: up with down, and where no direction leads
            yield from (Order(up=1, down=1), Order(*near()), Order(0, 0), Order(down=1),
                        Order(2, 1), Order(1, 1), Order(up=1))
        elif what == 7:
            if rng.random() < 0.5:
                yield Order(*near(), wait=clocks(40))
            yield from (Mode(0), Hold(clocks(4)))
            for _ in range(rng.randint(1, 4)):
                yield Jog(rng.getrandbits(6), clocks(60), release=rng.random() < 0.7)
            yield from (Jog(0, clocks(20)), Mode(1), Hold())
        elif what == 8:
            yield from (Order(*near(), wait=clocks(80)), Reset(rng.choice([1, 1, 2, 20])))
        elif what == 9:
            yield from (Order(*near(), wait=clocks(80)), Stop(clocks(3)), Hold(clocks(20)),
                        Reset(clocks(3)), Hold())
        elif what == 10:
            yield from (Order(down=1), Order(up=1))
        else:
            yield from (Select(rng.randrange(4)), Hold(clocks(60)))
    yield from (Order(1, 1), Hold())


def rows_of_actions(script: Iterable[Action]) -> Rows:
    """Write down a script. Where it waits for the machine, a row does."""
    pins = MillInputs()
    rows: list[Row] = []
    for action in script:
        waits = isinstance(action, Order) and action.wait is None and bool(pins.mode)
        if isinstance(action, Order):
            action = replace(action, wait=action.wait or 0)
        for _ in action.act(pins):
            levels = astuple(pins)
            if rows and rows[-1].levels == levels and not rows[-1].waits:
                rows[-1].clocks += 1
            else:
                rows.append(Row(levels, 1))
        if waits:
            rows.append(Row(astuple(pins), 0, waits=True))
    return Rows.of(rows)
