"""What can be asked of the command, and what it says of itself."""

import argparse
import os
from pathlib import Path

from tb.machines import machines

from ..console import Parser, whole

__all__ = ["UPSETS", "UPSETS_ON_A_LINE", "RESETS", "make_parser"]

RESETS, UPSETS, UPSETS_ON_A_LINE = 10_000, 1_000_000, 20_000
"""How many by default. A line is slow: much time passes until an upset is seen."""

ABOUT = """\
Injects faults into a raw machine while it works, on CXXRTL: resets at any time, or bit upsets of
flip-flops (SEU), as radiation and bad supplies cause them. Also counts what a guard, which makes
them visible, takes of an FPGA.
"""

EPILOG = """\
examples:
  python -m tools.faults resets
      10 000 resets of {first}; no motor may move for one.

  python -m tools.faults resets --machine {last}
      And of each build of {last}, such as the one with bowed lines.

  python -m tools.faults upsets
      A million upsets of each build of {first}, without its guard and with it; a minute or two.

  python -m tools.faults upsets --guard --upsets 10000000 --seed 7
      Others, and more of them, of the build with a guard alone.

  python -m tools.faults cost
      Look-up tables and flip-flops with and without the guard.

python -m tools.build --guard builds a machine with its guard, if it has one.
"""

ABOUT_RESETS = """\
Resets come at any time, for 1 to 30 clocks, while a machine is kept busy: by orders, and by pins at
random; or, if it has a serial line, by lines which move its motors soon after each reset, and by
fuzzing the line, with switches pressed at random.

In every clock each coil word must be one of the motor's table, and the one of the clock before or a
neighbour of it, or none where there is no power; each pulse as long as its driver module needs, and
DIR and ENABLE still around it. A reset must move no motor, begin no pulse and cut none. After it
all registers must be as from power-up but those that shall outlive it: the levels at the pins of
the motors, and for how long; the states of switches; the last words read from memories; orders
that were taken. After one reset of twenty a machine on a line must obey a command and answer it.
The exit status is 1 if any of that is not so.
"""

ABOUT_UPSETS = """\
In a random clock of work a random flip-flop changes. The work is done once without, and then from
there on with the upset: orders of every kind, stops, resets, and what else an operator does; over a
line commands that go to places, change speeds, stop movements or are wrong, breaks, switches and
resets. The stimulus waits for the machine where operators and order sources do. Some hundred clocks
later, or some thousand of a machine on a line, where the machine rests, or as soon as its state is
again what it would be, it came to one of

  harmless   motors and counters are where they would be
  visible    a fault was shown, outside a reset, where it would not have been, or for ever where the
             machine should be idle; or the motors or counters are wrong, but a line was answered
             otherwise than it would have been: by a refusal, or not at all
  stuck      it stands still and is never idle again, but its counters are right
  silent     none of these: the motors or the counters are wrong, and nothing shows it

Where the motors are is known from coil words and pulses alone. It is compared strictly: a step by
hand that comes too late, and so is not made before the switch is off, is silent too; so is an
endless movement that is stopped in another place because it was slower. Bits of memories are not
upset, and reports of positions are no answers.

The exit status is 1 if an upset of a machine with a guard is silent. Without a guard the silent
ones are counted, no more.
"""

ABOUT_COST = """\
Counts the look-up tables and flip-flops of a Spartan-3E that a raw machine takes with and without
its guard, by Yosys.
"""


def make_parser() -> argparse.ArgumentParser:
    """Make it."""
    names = [name for name, machine in machines().items() if machine.faults]
    every = list(machines())
    parser = Parser(prog="python -m tools.faults", description=ABOUT, machines=True,
                    epilog=EPILOG.format(first=names[0], last=names[-1]))
    kinds = parser.add_subparsers(dest="what", metavar="FAULT", required=True,
                                  help="resets, upsets (or flips) or cost; each has a --help")
    for name, aliases, about, count in [
            ("resets", [], ABOUT_RESETS, f"{RESETS}"),
            ("upsets", ["flips"], ABOUT_UPSETS, f"{UPSETS}, {UPSETS_ON_A_LINE} of a machine on a "
                                                "line")]:
        kind = kinds.add_parser(name, prog=f"{parser.prog} {name}", aliases=aliases,
                                description=about)
        kind.set_defaults(run=name)
        kind.add_argument("--machine", metavar="NAME", choices=every, default=names[0],
                          help=f"{', '.join(names)} (default: %(default)s)")
        kind.add_argument(f"--{name}", *(f"--{alias}" for alias in aliases), metavar="N",
                          type=whole(1), help=f"how many, for each machine (default: {count})")
        kind.add_argument("--seed", metavar="S", type=whole(0, (1 << 32) - 1), default=1,
                          help="of all chance: the same seed, the same result (default: 1)")
        kind.add_argument("--guard", action=argparse.BooleanOptionalAction,
                          help="a machine with its guard alone, or without it alone "
                               "(default: both)")
        kind.add_argument("--jobs", metavar="N", type=whole(1, 256), default=os.cpu_count() or 1,
                          help="cores to use (default: all)")
    cost = kinds.add_parser("cost", prog=f"{parser.prog} cost", description=ABOUT_COST)
    # The first machine whose component has a guard to be built with.
    cost.set_defaults(run="cost", machine=next(name for name, machine in machines().items() if any(
        options.get("guard") for options in machine.builds.values())))
    for kind in set(kinds.choices.values()):
        kind.add_argument("--json", metavar="FILE", type=Path, help="write all figures there")
    return parser
