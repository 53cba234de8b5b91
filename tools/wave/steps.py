"""Subcommand `steps`: the steps of motors, their rates and their faults."""

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
from .options import LEFT, Query, add_file, add_format, add_window, print_json, print_rows
from .rates import counted, line

__all__ = ["steps"]

ABOUT = f"""\
Decodes the signals of a motor into steps: time, axis, direction, position after the step.

  coil words   {", ".join(f"{word:04b}" for word in WORDS)}, and again: a step forward; in the other
               order a step back. A word that is not in the table, or two places away, is a
               fault.
  STEP, DIR    a step at each rising edge of STEP, forward where DIR is 1. It is a fault if DIR is
               unknown then, or changes at the same time. Words of several bits are an axis per bit.

The position is 0 at the start of the wave.
"""

EXAMPLES = f"""\
examples:
  python -m tools.wave steps mill.vcd
      The steps of axis_x, axis_y and axis_z, as far as the wave has them, and their rates.

  python -m tools.wave steps mill.vcd axis_x --from 100clk --csv steps.csv
      One axis, into a table.

  Pulses and directions of two axes; only the rates.

exit status: 0 if there are no faults, 1 if there are faults, 2 if the command is wrong,
{LEFT} if the output pipe is closed early.
"""

AXES = ("axis_x", "axis_y", "axis_z")

SHOWN = 20
"""Most faults that are printed; they are the first ones."""


def steps(subparsers) -> None:
    """Add the subcommand `steps`."""
    parser = subparsers.add_parser("steps", help="steps of motors, from coil words or STEP and DIR",
                                   description=ABOUT, epilog=EXAMPLES)
    add_file(parser)
    parser.add_argument("signals", metavar="SIGNAL", nargs="*",
                        help="coil words (default: those of "
                        f"{', '.join(AXES)} that the wave has)")
    parser.add_argument("--pair", metavar="STEP,DIR", action="append", default=[], dest="pairs",
                        help="a pulse and its direction; may be repeated")
    parser.add_argument("--csv", metavar="FILE", type=Path, help="write the steps to a file")
    parser.add_argument("--summary", action="store_true", help="do not list the steps")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_steps)


def _steps(args: argparse.Namespace) -> int:
    check_output(args.csv)
    query = Query.of(args)
    axes = _axes(query, args.pairs, args.signals)
    window = query.timeline.window(args.start, args.end)
    facts = [counted(query, axis, *window) for axis in axes]
    faults = sorted((time, axis.name, what) for axis in axes for time, what in axis.faults
                    if window[0] <= time <= window[1])
    rows = [{**query.moment(time), "axis": name, "fault": what} for time, name, what in faults]
    if args.csv is not None:
        write_atomically(args.csv, _csv(_rows(query, axes, *window)).encode())
    if args.json:
        listed = {} if args.summary else {"steps": list(_rows(query, axes, *window))}
        print_json({"axes": facts, "faults": rows, **listed})
        return 1 if faults else 0
    if not args.summary:
        print_rows(_rows(query, axes, *window), lambda row: (
            f"{row['time']:>14}{_clock(row)}  {row['axis']} {row['direction']:+} "
            f"to {row['position']}"))
    for fact in facts:
        say(line(fact))
    mark = colour("fault", 31, sys.stdout)
    for fault in rows[:SHOWN]:
        say(f"{mark} {fault['time']:>8}{_clock(fault)}  {fault['axis']}: {fault['fault']}")
    if len(rows) > SHOWN:
        say(f"and {len(rows) - SHOWN} faults more; --json lists them all")
    if args.csv is not None:
        say(f"wrote {args.csv}")
    return 1 if faults else 0


def _axes(query: Query, pairs: Sequence[str], signals: Sequence[str]) -> list[Axis]:
    """Decode the named signals, or else the default axes."""
    axes = []
    for pair in pairs:
        step, _, direction = pair.partition(",")
        if not step or not direction:
            raise UserError(f"--pair is written STEP,DIR, not {pair!r}")
        axes += from_pulses(query, names.one(query.wave, step), names.one(query.wave, direction))
    wanted = signals or ([] if pairs else _default_axes(query))
    return axes + [from_coils(query, signal) for signal in names.several(query.wave, wanted)]


def _default_axes(query: Query) -> list[str]:
    """Return those of the default axes that the wave has."""
    found = [name for name in AXES if names.found(query.wave, name)]
    if not found:
        raise UserError(f"{query.wave.path} has none of {', '.join(AXES)}: name its coil words, or "
                        "--pair STEP,DIR")
    return found


def _clock(row: dict[str, Any]) -> str:
    return f" ({row['clock']}clk)" if "clock" in row else ""


def _rows(
    query: Query, axes: Sequence[Axis], start: int, end: int
) -> Iterator[dict[str, Any]]:
    """Yield the steps of all axes, ordered by time."""
    times = np.concatenate([axis.times for axis in axes])
    place = np.repeat(np.arange(len(axes)), [len(axis.times) for axis in axes])
    signs = np.concatenate([axis.signs for axis in axes])
    at = np.concatenate([np.cumsum(axis.signs) for axis in axes])
    for row in np.lexsort((place, times)).tolist():
        if start <= times[row] <= end:
            yield {**query.moment(int(times[row])), "axis": axes[int(place[row])].name,
                   "direction": int(signs[row]), "position": int(at[row])}


def _csv(rows: Iterator[dict[str, Any]]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["seconds", "clock", "axis", "direction", "position"])
    for row in rows:
        table.writerow([repr(row["seconds"]), row.get("clock", ""), row["axis"], row["direction"],
                        row["position"]])
    return text.getvalue()
