"""Work for a milling machine that upsets or resets are to disturb: rows of input levels."""

import random
from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..models.mill import MillInputs
from ..script import Action, Hold, Jog, Mode, Order, Reset, Select, Stop
from ..stimulus import Stimulus

__all__ = ["Rows", "actions", "rows_of_actions", "rows_of_stimulus"]

REACH = 24
"""Farthest coordinate of an order, in steps."""


@dataclass(frozen=True)
class Rows:
    """Levels of all inputs of the mill, each row for some clocks.

    Attributes
    ----------
    levels : array of uint64
        A row of inputs, in the order of `MillInputs`, for each row.
    clocks : array of int64
        Clocks of each row.
    waits : array of uint8
        Whether it goes on then until the machine is ready.
    """

    levels: NDArray[np.uint64]
    clocks: NDArray[np.int64]
    waits: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.clocks)


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
    rows: list[list] = []  # levels, clocks, waits
    for action in script:
        waits = isinstance(action, Order) and action.wait is None and bool(pins.mode)
        if isinstance(action, Order):
            action = replace(action, wait=action.wait or 0)
        for _ in action.act(pins):
            levels = astuple(pins)
            if rows and rows[-1][0] == levels and not rows[-1][2]:
                rows[-1][1] += 1
            else:
                rows.append([levels, 1, 0])
        if waits:
            rows.append([astuple(pins), 0, 1])
    levels, clocks, waits = zip(*rows, strict=True)
    return Rows(np.array(levels, np.uint64), np.array(clocks, np.int64), np.array(waits, np.uint8))


def rows_of_stimulus(stimulus: Stimulus) -> Rows:
    """Write down levels of every clock."""
    levels = np.stack([stimulus[name].astype(np.uint64) for name in vars(MillInputs())], axis=1)
    begins = np.flatnonzero(np.r_[True, (levels[1:] != levels[:-1]).any(axis=1)])
    clocks = np.diff(begins, append=len(levels))
    return Rows(np.ascontiguousarray(levels[begins]), clocks.astype(np.int64),
                np.zeros(len(begins), np.uint8))
