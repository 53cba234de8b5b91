#!/usr/bin/env python3
"""Draw lines with a hanging plotter, from points of a file.

Each line of the file has two points, x y x y, in mm from the upper left corner of the wall, y down.
Ctrl-C stops the machine; it keeps its place, but within a bowed line.
"""

import argparse
import re
import sys
from pathlib import Path

from fresa_host import MachineError, VPlotter


def points(text: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the ends of each line."""
    lines = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        words = line.split()
        if len(words) != 4 or not all(re.fullmatch(r"\d{1,4}", word) for word in words):
            raise ValueError(f"line {number} must have four whole numbers from 0 to 9999, not "
                             f"{line[:60]!r}")
        x, y, to_x, to_y = map(int, words)
        lines.append(((x, y), (to_x, to_y)))
    return lines


def main() -> None:
    """Home it if that is wanted, and draw each line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("port", help="serial port of the machine, such as /dev/ttyUSB0")
    parser.add_argument("file", help="the points")
    parser.add_argument("--baud", type=int, default=9600, help="bits a second (%(default)s)")
    parser.add_argument("--home", action="store_true", help="home first, which takes minutes")
    arguments = parser.parse_args()
    lines = points(Path(arguments.file).read_text(encoding="ascii", errors="replace"))
    with VPlotter(arguments.port, baud=arguments.baud) as plotter:
        if arguments.home:
            plotter.home()
        for number, (start, end) in enumerate(lines, 1):
            plotter.draw_line(start, end)
            print(f"\r{number} of {len(lines)} lines", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
        print(f"{len(lines)} lines drawn")


if __name__ == "__main__":
    try:
        main()
    except (MachineError, OSError, ValueError) as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit("stopped")
