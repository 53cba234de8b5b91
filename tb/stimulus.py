"""What machines are given, the same for every engine: what was thought of, and then chance.

For the mill that is orders that wait for it, and pins each at a rate of its own; for any component,
levels to hold one after the other, and fields in changing moods.

Chance comes in blocks that stand alone: a seed and the number of a block give its rows, whatever
ran before.
"""

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .models.mill import MillInputs, MillModel
from .script import Action, Hold, Jog, Mode, Order, Reset, Select, Stop, Together, record

__all__ = ["BLOCK", "Chance", "Stimulus", "chance", "cut", "directed", "held", "last_rows", "moods",
           "orders", "random_blocks"]

Stimulus: TypeAlias = Mapping[str, NDArray]
"""Levels of every input, a row a clock."""

Chance: TypeAlias = Callable[[int, int, int], Stimulus]
"""Gives, of a seed and the number of a block, so many of its first rows."""

#: Rows of a block of chance.
BLOCK = 1 << 16

#: Inputs that, were they 1 often, would leave nothing else to see.
RARE = ("rst", "stop")


def orders(seed: int) -> Iterator[Action]:
    """Give actions without end, as people and order sources do them, and as they should not."""
    rng = random.Random(seed)

    def near() -> int:
        return rng.choice([rng.randrange(12), rng.randrange(12), rng.randrange(60)])

    yield from (Reset(), Mode(1))
    while True:
        what = rng.randrange(16)
        if what < 5:
            yield Order(near(), near(), start=rng.randint(1, 3))
        elif what < 7:
            yield Order(up=1) if rng.random() < 0.5 else Order(down=1)
        elif what == 7:  # refused: both ways at once
            yield Order(up=1, down=1)
        elif what == 8:  # refused unless straight or diagonal: milling to anywhere
            yield Order(down=1)
            yield Order(near(), near())
            yield Order(up=1)
        elif what == 9:  # an order into a movement
            yield Order(near(), near(), wait=rng.randrange(40))
            yield Order(near(), near(), up=rng.getrandbits(1), start=rng.randint(1, 30))
        elif what == 10:  # never let go of start
            yield Order(near(), near(), start=rng.randint(20, 200))
        elif what == 11:  # manual mode, perhaps in the middle of a movement
            if rng.random() < 0.5:
                yield Order(near(), near(), wait=rng.randrange(30))
            yield Mode(0)
            yield Hold(rng.randint(1, 3))
            for _ in range(rng.randint(1, 6)):
                yield Jog(rng.getrandbits(6), rng.randint(1, 40), release=rng.random() < 0.8)
            yield Mode(1)
        elif what == 12:  # switches that are on already when manual mode comes
            yield Together((("jog", rng.getrandbits(6)), ("mode", 0)), rng.randint(1, 20))
            yield Together((("jog", rng.getrandbits(6)), ("mode", 1)), rng.randint(1, 5))
        elif what == 13:
            yield Order(near(), near(), wait=rng.randrange(60))
            yield Stop(rng.randint(1, 3))
            yield Order(near(), near(), wait=rng.randrange(30))
            yield Reset(rng.randint(1, 3))
        elif what == 14:
            yield Order(near(), near(), wait=rng.randrange(60))
            yield Reset(rng.choice([1, 1, 2, 10]))
        else:
            yield Select(rng.randrange(4))
            yield Hold(rng.randint(1, 100))


def directed(model: MillModel, seed: int, clocks: int) -> dict[str, NDArray]:
    """Play `orders` to a model for so many clocks, and keep what its pins were given."""

    def enough() -> Iterator[Action]:
        for action in orders(seed):
            if model.clock >= clocks:
                break
            yield action

    recording = record(model, enough())
    return {name: np.array(row[:clocks], np.uint16) for name, row in recording.stimulus.items()}


def chance(seed: int, block: int, rows: int = BLOCK) -> dict[str, NDArray]:
    """Give the first rows of a block of chance.

    Each row has 64 random bits, and each pin its own of them.
    """
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, block])))
    bits = rng.integers(0, 1 << 64, BLOCK, np.uint64)
    low, high = bits.astype(np.uint32), (bits >> np.uint64(32)).astype(np.uint32)

    def rare(word: NDArray[np.uint32], place: int, width: int) -> NDArray[np.bool_]:
        """Once in 2 ** width clocks."""
        mask = np.uint32((1 << width) - 1 << place)
        return (word & mask) == 0

    def held(changes: NDArray[np.bool_], values: NDArray) -> NDArray:
        return values[np.cumsum(changes) % len(values)]

    far = rng.integers(0, 16, (2, 4096), np.uint16) == 0
    places = np.where(far, rng.integers(0, 1 << 16, far.shape, np.uint16),
                      rng.integers(0, 10, far.shape, np.uint16))
    places[1, ::4] = places[0, ::4]  # diagonals
    jogs = rng.integers(0, 64, 8192, np.uint16)
    moves = rare(high, 0, 6)
    tool = rare(high, 6, 1)
    made = {
        "rst": rare(low, 0, 9),
        "mode": held(rare(low, 9, 9), np.array([1, 1, 0], np.uint8)),
        "position_x": held(moves, places[0]),
        "position_y": held(moves, places[1]),
        "up": tool & rare(high, 7, 3),
        "down": tool & rare(high, 10, 3),
        "start": rare(low, 18, 2),
        "counter_select": held(rare(high, 13, 5), jogs & 3),
        "jog": held(rare(high, 18, 4), jogs & rng.integers(0, 64, 8192, np.uint16)),
        "stop": rare(low, 20, 11),
    }
    return {field.name: made[field.name][:rows] for field in fields(MillInputs)}


def held(pins: Iterable[str], holds: Iterable[tuple[Mapping[str, int], int]], clocks: int
         ) -> dict[str, NDArray]:
    """Give so many clocks of holds, or as many as there are; all pins are 0 before."""
    levels: Mapping[str, int] = dict.fromkeys(pins, 0)
    made: list[Mapping[str, int]] = []
    for changes, rows in holds:
        levels = {**levels, **changes}
        made += [levels] * rows
    return {name: np.array([row[name] for row in made[:clocks]], np.uint64) for name in levels}


def moods(fields: Mapping[str, Sequence[int]], seed: int, block: int, rows: int = BLOCK
          ) -> dict[str, NDArray]:
    """Give the first rows of a block of chance, for any inputs.

    Each field of an input has moods of its own, some dozens of clocks each: never, now and then,
    half the time, mostly or always 1, if it is a bit; staying or changing as often, if it is a
    number, and then mostly near 0, where numbers are equal, or at an end of their range.

    Parameters
    ----------
    fields : mapping of str to sequence of int
        Widths of the fields of each input, from bit 0.
    seed, block, rows : int
        As in :func:`chance`.
    """
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, block])))

    def often(choices: Sequence[float]) -> NDArray[np.bool_]:
        spell = np.cumsum(rng.random(BLOCK) < 1 / 48)
        return rng.random(BLOCK) < rng.choice(choices, BLOCK)[spell]

    def number(width: int) -> NDArray[np.uint64]:
        top = np.uint64((1 << width) - 1)
        near = rng.integers(0, 6, BLOCK, np.uint64) & top
        kinds = [near, near, near, top - near, top // np.uint64(2) + near & top,
                 rng.integers(0, top, BLOCK, np.uint64, endpoint=True)]
        return np.choose(rng.integers(0, len(kinds), BLOCK), kinds)

    made = {}
    for name, widths in fields.items():
        levels, place = np.zeros(BLOCK, np.uint64), 0
        for width in widths:
            if width > 1:
                value = number(width)[np.cumsum(often([0, 0.02, 0.2, 0.5, 1])) - 1]
            else:
                value = often([0, 0.01] if name in RARE else [0, 0.05, 0.5, 0.95, 1])
            levels |= value.astype(np.uint64) << np.uint64(place)
            place += width
        made[name] = levels[:rows]
    return made


def random_blocks(seed: int, clocks: int, *, first: int = 0, chance: Chance = chance
                  ) -> Iterator[Stimulus]:
    """Give so many clocks of chance, block by block."""
    for block in range(-(-clocks // BLOCK)):
        yield chance(seed, first + block, min(BLOCK, clocks - block * BLOCK))


def cut(stimulus: Stimulus, start: int, stop: int) -> dict[str, NDArray]:
    """Give some of the rows."""
    return {name: row[start:stop] for name, row in stimulus.items()}


def last_rows(blocks: Iterable[Stimulus], stop: int, most: int) -> dict[str, NDArray]:
    """Give the rows before one, at most so many."""
    kept: list[Stimulus] = []
    clock = 0
    for block in blocks:
        rows = len(next(iter(block.values())))
        kept.append(cut(block, 0, stop - clock))
        clock += rows
        if clock >= stop:
            break
        # What is further back than `most` even from here is never asked for.
        while sum(len(next(iter(part.values()))) for part in kept[1:]) >= most:
            kept.pop(0)
    joined = {name: np.concatenate([part[name] for part in kept]) for name in kept[0]}
    return {name: row[-most:] for name, row in joined.items()}
