#!/usr/bin/env python3
"""Turn the motor of `single` there and back: `python examples/turn_single.py PORT`.

Without the machine: `python -m tools.serve single` prints a PORT to use.
"""

import sys

from fresa_host import MachineError, Single

TURN = 96
"""Half steps of a turn."""

RPM = 2
"""What a turn a minute is to the machine, for it counts rpm in full steps."""


def main(port: str) -> None:
    """Make a turn, slowly, and come back fast."""
    with Single(port) as motor:
        print(f"at {motor.position}, {motor.speed / RPM:g} turns a minute")
        for turns, there in ((30, TURN), (120, 0)):
            motor.speed = RPM * turns
            motor.move_to(there)
            print(f"at {motor.wait(timeout=30)}, with {turns} turns a minute")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except MachineError as error:
        sys.exit(f"error: {error}")
