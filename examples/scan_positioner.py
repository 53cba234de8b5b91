#!/usr/bin/env python3
"""Scan a field with `positioner`, row by row: `python examples/scan_positioner.py PORT`.

Without the machine: `python -m tools.serve positioner` prints a PORT to use.
"""

import sys
from collections.abc import Iterator

from fresa_host import LimitReached, MachineError, Positioner

ROWS, COLUMNS = 2, 3
PITCH = 4
"""Distance from one place to the next, in um."""


def places() -> Iterator[tuple[int, int]]:
    """Give the places in um, every other row backwards: less to travel."""
    for row in range(ROWS):
        columns = range(COLUMNS)
        for column in columns if row % 2 == 0 else reversed(columns):
            yield column * PITCH, row * PITCH


def main(port: str) -> None:
    """Visit all places and come back."""
    with Positioner(port) as positioner:
        positioner.connect()
        positioner.origin()
        for axis in "xy":
            positioner.velocity(axis, 20)
        try:
            for x, y in places():
                positioner.move_to(x, y, 0)
                here = positioner.wait(timeout=10)
                print(f"measure at x {here.x:.2f}, y {here.y:.2f} um")
            positioner.move_to(0, 0, 0)
            positioner.wait(timeout=10)
        except LimitReached as limit:
            print(f"the field is too large: {limit}")
        finally:
            positioner.stop()
            positioner.disconnect()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except MachineError as error:
        sys.exit(f"error: {error}")
