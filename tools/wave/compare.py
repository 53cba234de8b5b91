"""Two waves compared: which signals are the same, when they first differ, and for how long."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..console import UserError, say, warn
from .options import Asked, add_format, add_window, plain, say_json
from .pairing import alike, pairs_of
from .reader import LATEST, Signal, Wave
from .trace import Trace, Value

__all__ = ["Difference", "compared", "diff"]

ABOUT = """\
Compares two waves of whatever format, over the time that they have in common.

Without SIGNAL, all signals that are in both are compared: those whose paths end alike, the longest
common end first. States with a name are not compared with bare codes. A value that is unknown in
one wave only is a difference.
"""

EXAMPLES = """\
examples:
  python -m tools.wave diff amaranth.vcd icarus.vcd
      Everything that has the same name.

  python -m tools.wave diff old.vcd new.vcd axis_x 'x.*' --from 100clk
      A few signals, from a clock of the first wave on.

  python -m tools.wave diff ours.vcd theirs.ghw --map bench.top.count=top.counter_q
      A signal that has another name there.

exit status: 0 if they agree, 1 if they differ, 2 if they cannot be compared.
"""

SHOWN = 20
"""Differences that are told, the first ones."""


@dataclass(frozen=True)
class Difference:
    """What became of a pair of signals.

    Attributes
    ----------
    pair : tuple of Signal
        The signal of each wave.
    first : int
        When they first differ, in ticks of the first wave's time as compared.
    values : tuple of Value
        What they are then.
    intervals : int
        How often they begin to differ.
    ticks : int
        How long they differ in all.
    """

    pair: tuple[Signal, Signal]
    first: int
    values: tuple[Value, Value]
    intervals: int
    ticks: int


def diff(subparsers) -> None:
    """Add the subcommand `diff`."""
    parser = subparsers.add_parser("diff", help="where two waves differ", description=ABOUT,
                                   epilog=EXAMPLES)
    parser.add_argument("file", metavar="A", type=Path, help="a waveform")
    parser.add_argument("other", metavar="B", type=Path, help="another")
    parser.add_argument("signals", metavar="SIGNAL", nargs="*", help="names or patterns of A")
    parser.add_argument("--map", metavar="A=B", action="append", default=[], dest="pairs",
                        help="compare these two; may be repeated")
    parser.add_argument("--json", action="store_true", help="answer in JSON")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_diff)


def _diff(args: argparse.Namespace) -> int:
    asked, other = Asked.of(args), Wave(args.other)
    pairs = pairs_of(asked.wave, other, args.signals, args.pairs)
    fit = [pair for pair in pairs if alike(*pair)]
    if not fit:
        raise UserError(f"{args.file} and {args.other} have no signals in common; "
                        "--map A=B names two")
    start, end = asked.timeline.window(args.start, args.end)
    tick = _common(asked.wave.tick, other.tick)
    scale = (int(asked.wave.tick / tick), int(other.tick / tick))
    if max(asked.wave.span[1] * scale[0], other.span[1] * scale[1]) > LATEST:
        raise UserError(f"the times of {args.file} and {args.other} are too far apart in scale")
    low = max(start * scale[0], other.span[0] * scale[1])
    high = min(end * scale[0], other.span[1] * scale[1])
    if high < low:
        raise UserError(f"{args.file} and {args.other} have no time in common")
    found = [difference for pair in fit if (difference := compared(
        pair, (asked.wave.trace(pair[0]), other.trace(pair[1])), scale, low, high))]
    found.sort(key=lambda difference: difference.first)
    facts = {
        "compared": len(fit), "different": len(found),
        "left_out": [[one.path, two.path] for one, two in pairs if not alike(one, two)],
        "differences": [_facts(asked, difference, scale[0]) for difference in found],
    }
    if args.json:
        say_json(facts)
    else:
        _tell(asked, facts, found)
    return 1 if found else 0


def _tell(asked: Asked, facts: dict[str, Any], found: Sequence[Difference]) -> None:
    if facts["left_out"]:
        one, two = facts["left_out"][0]
        warn(f"{len(facts['left_out'])} pairs are not compared, for one has names or fractions and "
             f"the other bits: first {one} and {two}")
    if not found:
        say(f"no difference in {facts['compared']} signals")
        return
    say(f"{len(found)} of {facts['compared']} signals differ")
    for difference, fact in list(zip(found, facts["differences"], strict=True))[:SHOWN]:
        one, two = difference.pair
        a, b = (asked.radixes.text(one, value) for value in difference.values)
        clock = f" ({fact['clock']}clk)" if "clock" in fact else ""
        known = one.path if one.path == two.path else f"{one.path}, {two.path}"
        often = "once" if difference.intervals == 1 else f"{difference.intervals} times"
        say(f"{fact['time']:>14}{clock}  {known}: {a}, {b}; {often}, {fact['differs']} in all")
    if len(found) > SHOWN:
        say(f"and {len(found) - SHOWN} more; --json lists them all")


def _facts(asked: Asked, difference: Difference, scale: int) -> dict[str, Any]:
    one, two = difference.pair
    first, long = (Fraction(ticks, scale) for ticks in (difference.first, difference.ticks))
    moment = asked.moment(first.__floor__())
    return {**moment, "seconds": float(first * asked.wave.tick),
            "time": asked.timeline.text(first), "signals": [one.path, two.path],
            "values": [plain(value) for value in difference.values],
            "intervals": difference.intervals, "differs": asked.timeline.text(long)}


def compared(
    pair: tuple[Signal, Signal], traces: tuple[Trace, Trace], scale: tuple[int, int], low: int,
    high: int,
) -> Difference | None:
    """Compare two traces.

    Parameters
    ----------
    pair, traces : pairs of Signal and Trace
        The two signals, and what they do.
    scale : pair of int
        Common ticks in a tick of each.
    low, high : int
        The time to compare, in common ticks; the value at `high` is compared as well.

    Returns
    -------
    Difference or None
        None if they agree.
    """
    own = [trace.times * factor for trace, factor in zip(traces, scale, strict=True)]
    times = np.unique(np.concatenate([
        [low], *(some[(some > low) & (some <= high)] for some in own)])).astype(np.int64)
    rows = [np.searchsorted(some, times, side="right") - 1 for some in own]
    differs = _differs(traces, rows)
    if not differs.any():
        return None
    lengths = np.diff(times, append=high)
    first = int(np.flatnonzero(differs)[0])
    one, two = (trace.value(int(row[first])) for trace, row in zip(traces, rows, strict=True))
    return Difference(pair, int(times[first]), (one, two),
                      int(np.count_nonzero(np.diff(differs.astype(np.int8), prepend=0) == 1)),
                      int(lengths[differs].sum()))


def _differs(traces: tuple[Trace, Trace], rows: Sequence[NDArray]) -> NDArray[np.bool_]:
    """Say in which rows two traces differ."""
    # Words get common numbers; what is before the first change is the last of all.
    table: dict[str, int] = {}
    codes, numbers = [], []
    for trace, row in zip(traces, rows, strict=True):
        # All bits unknown is unknown, be it written X, U or -.
        words = [table.setdefault("x" if not trace.named and not set(word) & set("01hl") else word,
                                  len(table)) for word in trace.words]
        own = np.append(np.array([*words, -1], np.int64)[trace.codes],
                        table.setdefault("x", len(table)))
        codes.append(own[row])
        numbers.append(np.append(trace.numbers, 0)[row])
    if numbers[0].dtype.kind == "u" and numbers[1].dtype.kind == "u":
        numbers = [number.astype(np.uint64) for number in numbers]
    return (codes[0] != codes[1]) | (
        (codes[0] < 0) & (codes[1] < 0) & np.asarray(numbers[0] != numbers[1], bool))


def _common(one: Fraction, two: Fraction) -> Fraction:
    """Give the longest tick of which both are multiples."""
    return Fraction(gcd(one.numerator * two.denominator, two.numerator * one.denominator),
                    one.denominator * two.denominator) if one != two else one
