#!/usr/bin/env python3
"""Stream a file of G-code to a machine that speaks GRBL's protocol, with progress.

Ctrl-C stops the machine; it keeps its position.
"""

import argparse
import sys

from fresa_host import GCode, MachineError


def show(done: int, total: int) -> None:
    """Show how far it is, in one line of the terminal."""
    print(f"\r{done} of {total} lines", end="", file=sys.stderr, flush=True)


def main() -> None:
    """Send it, and wait until it is carried out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("port", help="serial port of the machine, such as /dev/ttyUSB0")
    parser.add_argument("file", help="the program")
    parser.add_argument("--baud", type=int, default=115_200, help="bits a second (%(default)s)")
    parser.add_argument("--home", action="store_true", help="seek the home switches first")
    parser.add_argument("--unlock", action="store_true", help="end an alarm first")
    parser.add_argument("--line-by-line", action="store_true",
                        help="wait for each answer: nothing behind a refused line is carried out")
    arguments = parser.parse_args()
    with GCode(arguments.port, baud=arguments.baud) as machine:
        if arguments.unlock:
            machine.unlock()
        if arguments.home:
            machine.home()
        machine.stream(arguments.file, show, line_by_line=arguments.line_by_line)
        print(file=sys.stderr)
        machine.wait()
        print(f"at {machine.position}")


if __name__ == "__main__":
    try:
        main()
    except (MachineError, OSError, ValueError) as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit("stopped")
