"""Mistakes for the comparison of RTL and netlist: one bit of one look-up table, turned over."""

import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .flat import Flat, Net, cells

__all__ = ["Flip", "flips"]

_TABLE = re.compile(r"  (LUT[1-4]) #\(\s+\.INIT\((\d+)'h([0-9a-f]+)\)\s+\) (\S+) \(")


@dataclass(frozen=True)
class Flip:
    """A bit that is turned over.

    Attributes
    ----------
    summary : str
        Which.
    netlist : str
        The netlist with the mistake in it.
    reaches : frozenset of Net
        The outputs and registers that depend on that look-up table.
    """

    summary: str
    netlist: str
    reaches: frozenset[Net]


def flips(netlist: str, top: str, folder: Path, *, seed: int, count: int) -> Iterator[Flip]:
    """Choose bits of look-up tables at random, each in another table.

    Parameters
    ----------
    netlist, top : str
        What to spoil, and the name of its module.
    folder : path
        Where to work.
    seed : int
        The same seed gives the same bits of the same netlist.
    count : int
        How many, or as many as there are tables.
    """
    flat = cells(netlist, top, folder)
    tables = list(_TABLE.finditer(netlist))
    rng = random.Random(seed)
    for table in rng.sample(tables, min(count, len(tables))):
        kind, width, digits, name = table.groups()
        place = rng.randrange(int(width))
        spoilt = f"{int(digits, 16) ^ 1 << place:0{len(digits)}x}"
        start, end = table.span(3)
        yield Flip(f"bit {place} of {kind} {name}", netlist[:start] + spoilt + netlist[end:],
                   frozenset(_reaches(flat, name)))


def _reaches(flat: Flat, name: str) -> Iterator[Net]:
    """Follow the output of a cell to outputs of the design and to flip-flops."""
    shown = {bit: (port, index) for port, bits in flat.outputs.items()
             for index, bit in enumerate(bits)}
    (first,) = (cell for cell in flat.cells if cell.name == name.removeprefix("\\"))
    seen, left = {first.name}, [first]
    while left:
        cell = left.pop()
        for bit in (bit for bits in cell.outputs.values() for bit in bits):
            if cell.is_flip_flop:
                yield from flat.aliases.get(bit, [])
                continue
            if bit in shown:
                yield shown[bit]
            for pin in flat.readers.get(bit, []):
                if pin.cell.name not in seen:
                    seen.add(pin.cell.name)
                    left.append(pin.cell)
