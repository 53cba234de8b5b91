"""Stimulus: levels of the inputs of a machine or a component, one row per clock.

Half of it is directed, as each machine declares it; the other half is random. Random stimulus comes
in independent blocks: a seed and the number of a block determine its rows. For any component there
are levels held one after the other, and bursts.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLOCK", "Random", "Stimulus", "bursts", "cut", "held", "last_rows", "random_blocks"]

Stimulus: TypeAlias = Mapping[str, NDArray]
"""Levels of every input, one row per clock."""

Random: TypeAlias = Callable[[int, int, int], Stimulus]
"""Returns the first rows of a block, given a seed, the number of the block and a row count."""

#: Rows of a block of random stimulus.
BLOCK = 1 << 16

#: Inputs that would mask everything else if they were often 1.
RARE = ("rst", "stop")


def held(pins: Iterable[str], holds: Iterable[tuple[Mapping[str, int], int]], clocks: int
         ) -> dict[str, NDArray]:
    """Yield a number of clocks of holds, or all there are; all pins are 0 before."""
    levels: Mapping[str, int] = dict.fromkeys(pins, 0)
    made: list[Mapping[str, int]] = []
    for changes, rows in holds:
        levels = {**levels, **changes}
        made += [levels] * rows
    return {name: np.array([row[name] for row in made[:clocks]], np.uint64) for name in levels}


def bursts(fields: Mapping[str, Sequence[int]], seed: int, block: int, rows: int = BLOCK
           ) -> dict[str, NDArray]:
    """Return the first rows of a block of random stimulus, for any inputs.

    Each field of an input has bursts of its own, some dozens of clocks each, each with another
    rate: a bit is never, seldom, half the time, mostly or always 1; a number stays or changes as
    often, and is then mostly near 0, where comparisons are decided, or at an end of its range.

    Parameters
    ----------
    fields : mapping of str to sequence of int
        Widths of the fields of each input, from bit 0.
    seed, block, rows : int
        Seed, number of the block, and number of rows. Equal values give equal rows.
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


def random_blocks(random: Random, seed: int, clocks: int, *, first: int = 0) -> Iterator[Stimulus]:
    """Yield a number of clocks of random stimulus, from the first block on."""
    for block in range(-(-clocks // BLOCK)):
        yield random(seed, first + block, min(BLOCK, clocks - block * BLOCK))


def cut(stimulus: Stimulus, start: int, stop: int) -> dict[str, NDArray]:
    """Return a range of rows."""
    return {name: row[start:stop] for name, row in stimulus.items()}


def last_rows(blocks: Iterable[Stimulus], stop: int, most: int) -> dict[str, NDArray]:
    """Return the rows before one, up to a maximum."""
    kept: list[Stimulus] = []
    clock = 0
    for block in blocks:
        rows = len(next(iter(block.values())))
        kept.append(cut(block, 0, stop - clock))
        clock += rows
        if clock >= stop:
            break
        # Rows further back than `most` are never requested.
        while sum(len(next(iter(part.values()))) for part in kept[1:]) >= most:
            kept.pop(0)
    joined = {name: np.concatenate([part[name] for part in kept]) for name in kept[0]}
    return {name: row[-most:] for name, row in joined.items()}
