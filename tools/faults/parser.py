"""What can be asked of the command, and what it says of itself."""

import argparse
import os
from pathlib import Path

from ..console import Parser, whole

__all__ = ["make_parser"]

ABOUT = """\
Strikes the raw machine while it works, on CXXRTL: with resets at any time, or by changing a bit of
a flip-flop, as radiation and bad supplies do. And says what its guard, which makes that visible,
takes of an FPGA.
"""

EPILOG = """\
examples:
  python -m tools.faults resets
      10 000 resets; no motor may move for one.

  python -m tools.faults flips
      A million upsets of the machine without its guard, and a million with it; a minute or two.

  python -m tools.faults flips --guard --flips 10000000 --seed 7
      Others, and more of them, of the machine with its guard alone.

  python -m tools.faults cost
      Look-up tables and flip-flops with and without the guard.

python -m tools.build --guard builds the machine with its guard.
"""

ABOUT_RESETS = """\
Resets come at any time, for 1 to 30 clocks, while orders, jogs, stops and pins at random keep the
machine busy. In every clock each coil word must be one of the motor's table, and the one of the
clock before or a neighbour of it. A reset must change none; and after it all registers must be as
from power-up but those that shall outlive it: the coils, the time since their last steps, and that
start has been taken. The exit status is 1 if that is not so.
"""

ABOUT_FLIPS = """\
In a random clock of work a random flip-flop changes. The work is done once without, and then from
there on with the upset: jogs, orders of every kind, stops, resets and mode changes, each of which
waits for the machine where people and order sources do. After 400 clocks or more, where the machine
rests, or as soon as its state is again what it would be, it came to one of

  harmless   the motors are where they would be, and the counters say so
  visible    error was shown, outside a reset, where it would not have been, or for ever in place
             of ready
  stuck      it stands still and is never ready again, but its counters are right
  silent     none of these: without a word the motors are elsewhere, or the counters say so

Where the motors are is known from the coil words alone. It is compared strictly: a step by hand
that comes too late, and so is not made before the switch is off, is silent too.

The exit status is 1 if an upset of the machine with its guard is silent. Without the guard the
silent ones are counted, no more.
"""

ABOUT_COST = """\
Counts the look-up tables and flip-flops of a Spartan-3E that the raw machine takes with and without
its guard, by Yosys.
"""


def make_parser() -> argparse.ArgumentParser:
    """Make it."""
    parser = Parser(prog="python -m tools.faults", description=ABOUT, epilog=EPILOG)
    kinds = parser.add_subparsers(dest="what", metavar="FAULT", required=True,
                                  help="resets, flips or cost; each has a --help")
    for name, about, count in [("resets", ABOUT_RESETS, 10_000), ("flips", ABOUT_FLIPS, 1_000_000)]:
        kind = kinds.add_parser(name, prog=f"{parser.prog} {name}", description=about)
        kind.add_argument(f"--{name}", metavar="N", type=whole(1), default=count,
                          help="how many, for each machine (default: %(default)s)")
        kind.add_argument("--seed", metavar="S", type=whole(0, (1 << 32) - 1), default=1,
                          help="of all chance: the same seed, the same result (default: 1)")
        kind.add_argument("--guard", action=argparse.BooleanOptionalAction,
                          help="strike the machine with its guard alone, or without it alone "
                               "(default: both)")
        kind.add_argument("--jobs", metavar="N", type=whole(1, 256), default=os.cpu_count() or 1,
                          help="cores to use (default: all)")
    kinds.add_parser("cost", prog=f"{parser.prog} cost", description=ABOUT_COST)
    for kind in kinds.choices.values():
        kind.add_argument("--json", metavar="FILE", type=Path, help="write all figures there")
    return parser
