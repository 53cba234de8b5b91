"""Two waves compared: which signals correspond, when they first differ, and for how long."""

import argparse
from collections.abc import Sequence
from fractions import Fraction
from math import gcd
from pathlib import Path
from typing import Any

from ..console import UserError, say, warn
from . import names
from .difference import Difference, compared
from .options import LEFT, Query, add_format, add_window, plain, print_json
from .pairing import Pair, Pairing, alike, pairing_of
from .reader import LATEST, Signal, Wave

__all__ = ["diff"]

ABOUT = """\
Compares two waves, of any formats, over the time that they have in common.

Without SIGNAL, all signals that are in both are compared: those with equal ends of their paths, the
longest common end first. State names are not compared with state codes. A value that is unknown in
one wave only is a difference.

A signal that has another width in the other wave is a difference as well. A signal that is in one
wave only is listed, since a netlist lacks some signals of its source; it is a difference if SIGNAL
names it. --map compares two signals as numbers, whatever their widths; alone, it compares no
others.
"""

EXAMPLES = f"""\
examples:
  python -m tools.wave diff amaranth.vcd icarus.vcd
      Every signal that is in both.

  python -m tools.wave diff old.vcd new.vcd axis_x 'x.*' --from 100clk
      A few signals, from clock 100 of the first wave.

  python -m tools.wave diff ours.vcd theirs.ghw --map bench.top.count=top.counter_q
      A signal that has another name in the other wave.

exit status: 0 if they agree; 1 if values or widths differ, or a signal that is named by SIGNAL is
in one wave only; 2 if they cannot be compared; {LEFT} if the output pipe is closed early.
"""

SHOWN = 20
"""Most differences that are printed; they are the first ones."""


def diff(subparsers) -> None:
    """Add the subcommand `diff`."""
    parser = subparsers.add_parser("diff", help="where two waves differ", description=ABOUT,
                                   epilog=EXAMPLES)
    parser.add_argument("file", metavar="A", type=Path, help="a waveform")
    parser.add_argument("other", metavar="B", type=Path, help="another")
    parser.add_argument("signals", metavar="SIGNAL", nargs="*",
                        help="names or patterns, of A or else of B")
    parser.add_argument("--map", metavar="A=B", action="append", default=[], dest="pairs",
                        help="compare these two; may be repeated")
    parser.add_argument("--json", action="store_true", help="answer in JSON")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_diff)


def _diff(args: argparse.Namespace) -> int:
    query, other = Query.of(args), Wave(args.other)
    pairing = pairing_of(query.wave, other, args.signals, args.pairs)
    fit = [pair for pair in pairing.same if alike(*pair)]
    mismatched = bool(pairing.other_width or args.signals and any(pairing.only))
    if not fit and not mismatched:
        raise UserError(f"{args.file} and {args.other} have no signals in common; "
                        "--map A=B names two")
    found, scale = _found(query, other, fit, query.timeline.window(args.start, args.end))
    facts = {
        "compared": len(fit), "different": len(found),
        "left_out": [_paths(pair) for pair in pairing.same if not alike(*pair)],
        "other_width": [{"signals": _paths(pair), "bits": [signal.bits for signal in pair]}
                        for pair in pairing.other_width],
        **{f"only_in_{name}": _paths(side)
           for name, side in zip("ab", pairing.only, strict=True)},
        "differences": [_facts(query, difference, scale) for difference in found],
    }
    if args.json:
        print_json(facts)
    else:
        _report(query, facts, found)
        _report_pairing(pairing, (args.file, args.other))
    return 1 if found or mismatched else 0


def _found(
    query: Query, other: Wave, pairs: Sequence[Pair], window: tuple[int, int]
) -> tuple[list[Difference], int]:
    """Return the pairs that differ, ordered by time, and common ticks in one of the first wave."""
    tick = _common(query.wave.tick, other.tick)
    scale = (int(query.wave.tick / tick), int(other.tick / tick))
    if max(query.wave.span[1] * scale[0], other.span[1] * scale[1]) > LATEST:
        raise UserError(f"the times of {query.wave.path} and {other.path} differ too much in "
                        "scale")
    low = max(window[0] * scale[0], other.span[0] * scale[1])
    high = min(window[1] * scale[0], other.span[1] * scale[1])
    if high < low:
        raise UserError(f"{query.wave.path} and {other.path} have no time in common")
    found = [difference for pair in pairs if (difference := compared(
        pair, (query.wave.trace(pair[0], keep=False), other.trace(pair[1], keep=False)),
        scale, low, high))]
    return sorted(found, key=lambda difference: difference.first), scale[0]


def _report(query: Query, facts: dict[str, Any], found: Sequence[Difference]) -> None:
    if facts["left_out"]:
        one, two = facts["left_out"][0]
        warn(f"{len(facts['left_out'])} pairs are not compared, for one has names or fractions and "
             f"the other bits: first {one} and {two}")
    if not found:
        if facts["compared"]:
            say(f"no difference in {facts['compared']} signals")
        return
    say(f"{len(found)} of {facts['compared']} signals differ")
    for difference, fact in list(zip(found, facts["differences"], strict=True))[:SHOWN]:
        one, two = difference.pair
        a, b = (query.radixes.text(one, value) for value in difference.values)
        clock = f" ({fact['clock']}clk)" if "clock" in fact else ""
        known = one.path if one.path == two.path else f"{one.path}, {two.path}"
        often = "once" if difference.intervals == 1 else f"{difference.intervals} times"
        say(f"{fact['time']:>14}{clock}  {known}: {a}, {b}; {often}, {fact['differs']} in all")
    if len(found) > SHOWN:
        say(f"and {len(found) - SHOWN} more; --json lists them all")


def _report_pairing(pairing: Pairing, files: Sequence[Path]) -> None:
    if pairing.other_width:
        say("of another width: " + names.listed(
            f"{one.path}, {one.bits} bits and {two.bits}" if one.path == two.path else
            f"{one.path}, {one.bits} bits, and {two.path}, {two.bits}"
            for one, two in pairing.other_width))
    for file, side in zip(files, pairing.only, strict=True):
        if side:
            say(f"only in {file}: {names.listed(_paths(side))}")


def _paths(signals: Sequence[Signal]) -> list[str]:
    return [signal.path for signal in signals]


def _facts(query: Query, difference: Difference, scale: int) -> dict[str, Any]:
    one, two = difference.pair
    first, long = (Fraction(ticks, scale) for ticks in (difference.first, difference.ticks))
    moment = query.moment(first.__floor__())
    return {**moment, "seconds": float(first * query.wave.tick),
            "time": query.timeline.text(first), "signals": [one.path, two.path],
            "values": [plain(value) for value in difference.values],
            "intervals": difference.intervals, "differs": query.timeline.text(long)}


def _common(one: Fraction, two: Fraction) -> Fraction:
    """Return the longest tick of which both are multiples."""
    return Fraction(gcd(one.numerator * two.denominator, two.numerator * one.denominator),
                    one.denominator * two.denominator) if one != two else one
