#!/usr/bin/env python3
"""Mill a rosette of squares and rhombi: `python examples/mill_rosette.py PORT`.

Without the machine: `python -m tools.serve mill` prints a PORT to use.
"""

import sys
from collections.abc import Iterator

from fresa_host import Kind, MachineError, Mill, Order

RINGS = 3
PITCH = 24
"""From one ring to the next, in steps: 0.1 mm."""


def rosette() -> Iterator[list[tuple[int, int]]]:
    """Give the corners of all figures in steps, the innermost first."""
    middle = RINGS * PITCH
    for r in range(PITCH, middle + 1, PITCH):
        for corners in ([(-r, -r), (-r, r), (r, r), (r, -r)], [(-r, 0), (0, r), (r, 0), (0, -r)]):
            yield [(middle + x, middle + y) for x, y in corners]


def mill_around(corners: list[tuple[int, int]]) -> Iterator[Order]:
    """Give the orders that mill a closed figure. Each side is along one of 8 directions."""
    first, *others = [Order(Kind.GO, x, y) for x, y in corners]
    yield from (Order(Kind.UP), first, Order(Kind.DOWN), *others, first)


def main(port: str) -> None:
    """Mill it, and bring the tool back."""
    orders = [order for corners in rosette() for order in mill_around(corners)]
    orders += [Order(Kind.UP), Order(Kind.GO, 0, 0)]
    with Mill(port) as mill:
        mill.carry_out(orders, progress=lambda done, total: print(f"{done} of {total} orders done"))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except MachineError as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit("ended; the same command goes on")
