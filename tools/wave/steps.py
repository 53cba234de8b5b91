"""The subcommand `steps`: lists the steps of motors, their rates and their faults."""

import argparse
import csv
import io
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tb.plant import WORDS

from ..console import UserError, check_output, colour, say, write_atomically
from . import names
from .decode import Axis, from_coils, from_pulses
from .options import LEFT, Asked, add_file, add_format, add_window, say_json, say_rows
from .rates import counted, line

__all__ = ["steps"]

ABOUT = f"""\
Decodes the signals of a motor into steps: time, axis, direction, position after the step.

  coil words   {", ".join(f"{word:04b}" for word in WORDS)}, and again: a step forward; the other
               way round a step back. A word that is not in the table, or is two further on, is a
               fault.
  STEP, DIR    a step at each rising edge of STEP, forward where DIR is 1. It is a fault if DIR is
               unknown then, or changes at that very time. Words of several bits are an axis each.

The position is 0 at the start of the wave.
"""

EXAMPLES = f"""\
examples:
  python -m tools.wave steps mill.vcd
      The steps of axis_x, axis_y and axis_z, those that are there, and their rates.

  python -m tools.wave steps mill.vcd axis_x --from 100clk --csv steps.csv
      One axis, into a table.

  python -m tools.wave steps driver.fst --pair x_step,x_dir --pair y_step,y_dir --summary
      Pulses and directions of two axes; only the rates.

exit status: 0 if no fault is found, 1 if there are faults, 2 if the question is wrong,
{LEFT} if the reader of the output leaves early.
"""

AXES = ("axis_x", "axis_y", "axis_z")

SHOWN = 20
"""Most faults that are printed, the first ones."""


def steps(subparsers) -> None:
    """Add the subcommand `steps`."""
    parser = subparsers.add_parser("steps", help="steps of motors, from coil words or STEP and DIR",
                                   description=ABOUT, epilog=EXAMPLES)
    add_file(parser)
    parser.add_argument("signals", metavar="SIGNAL", nargs="*",
                        help="coil words (default: those of "
                        f"{', '.join(AXES)} that are there)")
    parser.add_argument("--pair", metavar="STEP,DIR", action="append", default=[], dest="pairs",
                        help="a pulse and its direction; may be repeated")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="write the steps there")
    parser.add_argument("--summary", action="store_true", help="do not list the steps")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_steps)


def _steps(args: argparse.Namespace) -> int:
    check_output(args.csv)
    asked = Asked.of(args)
    axes = _axes(asked, args.pairs, args.signals)
    window = asked.timeline.window(args.start, args.end)
    facts = [counted(asked, axis, *window) for axis in axes]
    faults = sorted((time, axis.name, what) for axis in axes for time, what in axis.faults
                    if window[0] <= time <= window[1])
    told = [{**asked.moment(time), "axis": name, "fault": what} for time, name, what in faults]
    if args.csv is not None:
        write_atomically(args.csv, _csv(_rows(asked, axes, *window)).encode())
    if args.json:
        listed = {} if args.summary else {"steps": list(_rows(asked, axes, *window))}
        say_json({"axes": facts, "faults": told, **listed})
        return 1 if faults else 0
    if not args.summary:
        say_rows(_rows(asked, axes, *window), lambda row: (
            f"{row['time']:>14}{_clock(row)}  {row['axis']} {row['direction']:+} "
            f"to {row['position']}"))
    for fact in facts:
        say(line(fact))
    mark = colour("fault", 31, sys.stdout)
    for fault in told[:SHOWN]:
        say(f"{mark} {fault['time']:>8}{_clock(fault)}  {fault['axis']}: {fault['fault']}")
    if len(told) > SHOWN:
        say(f"and {len(told) - SHOWN} faults more; --json lists them all")
    if args.csv is not None:
        say(f"wrote {args.csv}")
    return 1 if faults else 0


def _axes(asked: Asked, pairs: Sequence[str], signals: Sequence[str]) -> list[Axis]:
    """Decode what is named, or else the usual axes."""
    axes = []
    for pair in pairs:
        step, _, direction = pair.partition(",")
        if not step or not direction:
            raise UserError(f"--pair is written STEP,DIR, not {pair!r}")
        axes += from_pulses(asked, names.one(asked.wave, step), names.one(asked.wave, direction))
    wanted = signals or ([] if pairs else _usual(asked))
    return axes + [from_coils(asked, signal) for signal in names.several(asked.wave, wanted)]


def _usual(asked: Asked) -> list[str]:
    """Return those of the usual axes that the wave has."""
    found = [name for name in AXES if names.found(asked.wave, name)]
    if not found:
        raise UserError(f"{asked.wave.path} has none of {', '.join(AXES)}: name its coil words, or "
                        "--pair STEP,DIR")
    return found


def _clock(row: dict[str, Any]) -> str:
    return f" ({row['clock']}clk)" if "clock" in row else ""


def _rows(
    asked: Asked, axes: Sequence[Axis], start: int, end: int
) -> Iterator[dict[str, Any]]:
    """Return the steps of all axes in the order of their times."""
    times = np.concatenate([axis.times for axis in axes])
    place = np.repeat(np.arange(len(axes)), [len(axis.times) for axis in axes])
    signs = np.concatenate([axis.signs for axis in axes])
    at = np.concatenate([np.cumsum(axis.signs) for axis in axes])
    for row in np.lexsort((place, times)).tolist():
        if start <= times[row] <= end:
            yield {**asked.moment(int(times[row])), "axis": axes[int(place[row])].name,
                   "direction": int(signs[row]), "position": int(at[row])}


def _csv(rows: Iterator[dict[str, Any]]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["seconds", "clock", "axis", "direction", "position"])
    for row in rows:
        table.writerow([repr(row["seconds"]), row.get("clock", ""), row["axis"], row["direction"],
                        row["position"]])
    return text.getvalue()
