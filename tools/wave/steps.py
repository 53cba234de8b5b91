"""Steps of motors, decoded from coil words or from STEP and DIR."""

import argparse
import csv
import io
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tb.plant import WORDS, Motor

from ..console import UserError, check_output, colour, say, write_atomically
from . import names
from .options import LEFT, Asked, add_file, add_format, add_window, say_json, say_rows
from .reader import Signal

__all__ = ["Axis", "from_coils", "from_pulses", "steps"]

ABOUT = f"""\
Decodes what a motor is told to steps: time, axis, direction, position after the step.

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
{LEFT} if whoever reads the output leaves early.
"""

AXES = ("axis_x", "axis_y", "axis_z")

NO_WORD = 1 << 20
"""Stands for a coil word that is unknown."""

SHOWN = 20
"""Faults that are told, the first ones."""


@dataclass(frozen=True)
class Axis:
    """What a motor does.

    Attributes
    ----------
    name : str
        Its signal.
    times, signs : array of int64
        When it steps, in ticks, and which way: 1 or -1.
    faults : list of tuple of int and str
        When it is told what it cannot follow, and what.
    """

    name: str
    times: NDArray[np.int64]
    signs: NDArray[np.int64]
    faults: list[tuple[int, str]]


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


def from_coils(asked: Asked, signal: Signal) -> Axis:
    """Decode a signal whose values are coil words.

    Raises
    ------
    UserError
        If its values are no words of four bits.
    """
    if signal.kind != "bits" or signal.bits != 4:
        raise UserError(f"{signal.path} is no coil word: it does not have 4 bits")
    trace = asked.wave.trace(signal)
    if not len(trace):
        return Axis(signal.path, trace.times, trace.times, [])
    words = np.where(trace.unknown, NO_WORD, trace.numbers.astype(np.int64))
    rows, signs, illegal, jumps = Motor().feed(trace.times, words)

    def word(row: int) -> str:
        return asked.radixes.text(signal, trace.value(row))

    faults = [(int(trace.times[row]), f"{word(row)} is no coil word") for row in illegal]
    faults += [(int(trace.times[row]), f"a jump to {word(row)}, two words on")
               for row in jumps]
    return Axis(signal.path, trace.times[rows], signs, sorted(faults))


def from_pulses(asked: Asked, step: Signal, direction: Signal) -> list[Axis]:
    """Decode pulses and directions; words of several bits are an axis each, the lowest first.

    Raises
    ------
    UserError
        If they are not as wide as each other.
    """
    if step.bits != direction.bits or not 0 < step.bits <= 64:
        raise UserError(f"{step.path} has {step.bits} bits and {direction.path} "
                        f"{direction.bits}: they cannot be STEP and DIR")
    pulses, ways = asked.wave.trace(step), asked.wave.trace(direction)
    axes = []
    for bit in range(step.bits):
        level = np.where(pulses.codes >= 0, -1, pulses.numbers.astype(np.uint64) >> np.uint64(bit)
                         & np.uint64(1)).astype(np.int64)
        times = pulses.times[1:][(level[:-1] == 0) & (level[1:] == 1)]
        # An unknown direction is told as -1, and as a step forward.
        way = np.where(ways.codes >= 0, -1, ways.numbers.astype(np.uint64) >> np.uint64(bit)
                       & np.uint64(1)).astype(np.int64)
        way = np.append(way, -1)
        now, before = way[ways.rows(times)], way[ways.rows(times - 1)]
        name = step.path if step.bits == 1 else f"{step.path}[{bit}]"
        faults = [(int(time), "a step while the direction is unknown") for time in times[now < 0]]
        faults += [(int(time), "the direction changes with the step")
                   for time in times[(now >= 0) & (before >= 0) & (now != before)]]
        axes.append(Axis(name, times, np.where(now == 0, -1, 1), sorted(faults)))
    return axes


def _steps(args: argparse.Namespace) -> int:
    check_output(args.csv)
    asked = Asked.of(args)
    axes = []
    for pair in args.pairs:
        step, _, direction = pair.partition(",")
        if not step or not direction:
            raise UserError(f"--pair is written STEP,DIR, not {pair!r}")
        axes += from_pulses(asked, names.one(asked.wave, step), names.one(asked.wave, direction))
    wanted = args.signals or ([] if args.pairs else _usual(asked))
    axes += [from_coils(asked, signal) for signal in names.several(asked.wave, wanted)]
    window = asked.timeline.window(args.start, args.end)
    facts = [_facts(asked, axis, *window) for axis in axes]
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
        say(_summary(fact))
    mark = colour("fault", 31, sys.stdout)
    for fault in told[:SHOWN]:
        say(f"{mark} {fault['time']:>8}{_clock(fault)}  {fault['axis']}: {fault['fault']}")
    if len(told) > SHOWN:
        say(f"and {len(told) - SHOWN} faults more; --json lists them all")
    if args.csv is not None:
        say(f"wrote {args.csv}")
    return 1 if faults else 0


def _usual(asked: Asked) -> list[str]:
    """Give those of the usual axes that the wave has."""
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
    """Give the steps of all axes in the order of their times."""
    times = np.concatenate([axis.times for axis in axes])
    place = np.repeat(np.arange(len(axes)), [len(axis.times) for axis in axes])
    signs = np.concatenate([axis.signs for axis in axes])
    at = np.concatenate([np.cumsum(axis.signs) for axis in axes])
    for row in np.lexsort((place, times)).tolist():
        if start <= times[row] <= end:
            yield {**asked.moment(int(times[row])), "axis": axes[int(place[row])].name,
                   "direction": int(signs[row]), "position": int(at[row])}


def _facts(asked: Asked, axis: Axis, start: int, end: int) -> dict[str, Any]:
    """Count the steps of an axis, and give their rates in steps a second."""
    inside = (axis.times >= start) & (axis.times <= end)
    times, signs = axis.times[inside], axis.signs[inside]
    facts: dict[str, Any] = {
        "axis": axis.name, "steps": len(times), "forward": int((signs > 0).sum()),
        "back": int((signs < 0).sum()),
        "position": int(axis.signs[axis.times <= end].sum()),
    }
    if len(times) > 1:
        apart = np.diff(times)
        facts["most_steps_per_second"] = 1 / float(int(apart.min()) * asked.wave.tick)
        facts["mean_steps_per_second"] = (len(times) - 1) / float(
            int(times[-1] - times[0]) * asked.wave.tick)
        facts["least_apart"] = asked.timeline.text(int(apart.min()))
        if len(asked.timeline.rises):
            facts["least_clocks"] = int(np.diff(asked.timeline.clocks(times)).min())
    return facts


def _summary(fact: dict[str, Any]) -> str:
    text = (f"{fact['axis']}: {fact['steps']} steps, {fact['forward']} forward, {fact['back']} "
            f"back, at {fact['position']}")
    if "least_apart" in fact:
        clocks = f" ({fact['least_clocks']}clk)" if "least_clocks" in fact else ""
        text += (f"; at least {fact['least_apart']}{clocks} apart, at most "
                 f"{fact['most_steps_per_second']:.6g} steps/s, "
                 f"mean {fact['mean_steps_per_second']:.6g}")
    return text


def _csv(rows: Iterator[dict[str, Any]]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["seconds", "clock", "axis", "direction", "position"])
    for row in rows:
        table.writerow([repr(row["seconds"]), row.get("clock", ""), row["axis"], row["direction"],
                        row["position"]])
    return text.getvalue()
