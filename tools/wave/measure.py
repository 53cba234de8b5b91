"""Measuring a wave: where a condition holds, how often and how evenly signals change."""

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..console import say
from . import names
from .expression import evaluate
from .options import LEFT, Asked, add_file, add_format, add_window, say_json, say_rows
from .parser import parse
from .reader import Signal
from .trace import each

__all__ = ["find", "measured", "stats"]

FIND_ABOUT = """\
Shows the times at which a condition begins to hold, and for how long, or at which an event happens.

  rise X, fall X, change X   events: X becomes true, becomes false, has another value
  == != < <= > >=            compare a number, or a name in quotes
  X[3], X[7:4]               bits of X;  & | ^ work on all bits
  and, or, not, ( )          join conditions; an event and a condition: the event while it holds
  unknown X                  a bit of X is neither 0 nor 1

Numbers are written 12, -3, 0x1F, 0b1100. A bit or a number by itself holds while it is not 0; what
is unknown neither holds nor does not. Positions (at_x, x.count) and what --radix calls signed go
below 0. A signal with odd characters in its name stands between backquotes.

Signals that the condition does not name take no memory. Those that it names and the clock take,
beside some 50 MB for the program, up to six times the size of the file: so much if hardly anything
else changes in it.
"""

FIND_EXAMPLES = f"""\
examples:
  python -m tools.wave find mill.vcd 'rise ready'
      When orders are done.

  python -m tools.wave find mill.vcd 'motion_state_state == "STRAIGHT"'
      A state may be named with its code, STRAIGHT/7, or without.

  python -m tools.wave find mill.vcd 'rise step[0] and not direction[0]' --from 100clk | head
      Steps of X backwards.

exit status: 0 if it is found, 1 if it never is, 2 if something is wrong with the question,
{LEFT} if the reader of the output leaves early, as head does.
"""

STATS_ABOUT = """\
Measures signals: edges, and the least, the mean and the most of

  period     from one rising edge to the next (of a bus: from one change to the next)
  high       from a rising edge to the falling edge (of a single bit)
  jitter     the longest period less the shortest, also in clocks
"""

STATS_EXAMPLES = """\
examples:
  python -m tools.wave stats mill.vcd clk controller.step axis_x
      Three signals.

  python -m tools.wave stats mill.vcd '*' --json
      All of them.
"""


def find(subparsers) -> None:
    """Add the subcommand `find`."""
    parser = subparsers.add_parser("find", help="the times at which a condition holds",
                                   description=FIND_ABOUT, epilog=FIND_EXAMPLES)
    add_file(parser)
    parser.add_argument("expression", metavar="EXPR", help="the condition, in quotes")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_find)


def stats(subparsers) -> None:
    """Add the subcommand `stats`."""
    parser = subparsers.add_parser("stats", help="edges, periods, high times and jitter",
                                   description=STATS_ABOUT, epilog=STATS_EXAMPLES)
    add_file(parser)
    parser.add_argument("signals", metavar="SIGNAL", nargs="+", help="names or patterns")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_stats)


def _find(args: argparse.Namespace) -> int:
    node = parse(args.expression)
    asked = Asked.of(args)
    condition = evaluate(node, asked.wave, asked.radixes)
    start, end = asked.timeline.window(args.start, args.end)
    begins, ends = condition.stretches(asked.wave.span[1])
    inside = (begins <= end) & (ends >= start if condition.event else (ends > start) | (
        begins >= start))
    begins, ends = begins[inside], ends[inside]

    def line(row: dict[str, Any]) -> str:
        clock = f"  {row['clock']:>8}clk" if "clock" in row else ""
        return f"{row['time']:>14}{clock}" + (
            "" if condition.event else f"  for {row['for']['time']}" + (
                f" ({row['for']['clock']}clk)" if clock else ""))

    rows = (asked.moment(begin) | ({} if condition.event else {"for": {
        "seconds": float((stop - begin) * asked.wave.tick),
        "time": asked.timeline.text(stop - begin),
        **({"clock": int(asked.timeline.clocks(stop) - asked.timeline.clocks(begin))}
           if len(asked.timeline.rises) else {}),
    }}) for begin, stop in each(begins, ends))
    say_rows(rows, None if args.json else line)
    return 0 if len(begins) else 1


def _stats(args: argparse.Namespace) -> int:
    asked = Asked.of(args)
    signals = names.several(asked.wave, args.signals)
    window = asked.timeline.window(args.start, args.end)
    if not args.json:
        clock = asked.timeline.clock
        period = asked.timeline.period
        say(f"from {asked.timeline.text(window[0])} to {asked.timeline.text(window[1])}" + (
            f", clock {clock.path} of {asked.timeline.text(period)}" if clock and period else
            ", no clock"))
    facts = (measured(asked, signal, *window) for signal in signals)
    if args.json:
        say_json(list(facts))
        return 0
    for fact in facts:
        say("\n".join(_lines(asked, fact)))
    return 0


def measured(asked: Asked, signal: Signal, start: int, end: int) -> dict[str, Any]:
    """Measure a signal from a time to another, both in ticks.

    Returns
    -------
    dict
        Its path; ``changes``; of one bit ``rises`` and ``falls``; and where there are edges enough
        ``period``, ``high`` and ``jitter``. The first two are of ``least``, ``mean`` and ``most``.
        A time is a dict of ticks, seconds, and clocks if there is another signal that is the clock.
    """
    trace = asked.wave.trace(signal, keep=False)
    clock = asked.timeline.clock
    clocked = len(asked.timeline.rises) > 0 and clock is not None and clock.id != signal.id

    def inside(times: NDArray[np.int64]) -> NDArray[np.int64]:
        return times[np.searchsorted(times, start):np.searchsorted(times, end, side="right")]

    # The first value of a wave is no change.
    marks = inside(trace.times if signal.kind == "event" else trace.times[1:])
    facts: dict[str, Any] = {"path": signal.path, "changes": len(marks)}
    if signal.bits == 1 and signal.kind == "bits":
        marks, falls = inside(trace.edges(rising=True)), inside(trace.edges(rising=False))
        facts |= {"rises": len(marks), "falls": len(falls)}
        # The falling edge after each rising one; the last ones may have none.
        after = np.searchsorted(falls, marks)
        whole = int(np.searchsorted(after, len(falls)))
        if whole:
            facts["high"] = _spread(asked, marks[:whole], falls[after[:whole]], clocked)
    if len(marks) > 1:
        facts["period"] = _spread(asked, marks[:-1], marks[1:], clocked)
        facts["jitter"] = {name: most - facts["period"]["least"][name]
                           for name, most in facts["period"]["most"].items()}
    if unknown := int(np.count_nonzero(trace.unknown)):
        facts["unknown"] = unknown
    return facts


def _spread(
    asked: Asked, begins: NDArray[np.int64], ends: NDArray[np.int64], clocked: bool
) -> dict[str, Any]:
    """Return the least, the mean and the most of the times from begins to ends."""
    sizes: dict[str, dict[str, Any]] = {"least": {}, "mean": {}, "most": {}}

    def note(name: str, apart: NDArray) -> None:
        for size, measure in zip(sizes.values(), (np.min, np.mean, np.max), strict=True):
            size[name] = measure(apart).item()

    note("ticks", ends - begins)
    for size in sizes.values():
        size["seconds"] = float(size["ticks"] * asked.wave.tick)
    if clocked:
        note("clocks", asked.timeline.clocks(ends) - asked.timeline.clocks(begins))
    return sizes


def _lines(asked: Asked, facts: dict[str, Any]) -> Sequence[str]:
    """Tell what was measured of a signal."""
    edges = f", {facts['rises']} rises, {facts['falls']} falls" if "rises" in facts else ""
    lines = [facts["path"], f"  changes  {facts['changes']}{edges}"]

    def told(size: dict[str, Any]) -> str:
        clocks = f" ({size['clocks']:.6g}clk)" if "clocks" in size else ""
        return asked.timeline.text(size["ticks"]) + clocks

    for name in ("period", "high"):
        if name in facts:
            sizes = ", ".join(f"{kind} {told(size)}" for kind, size in facts[name].items())
            lines.append(f"  {name:7}  {sizes}")
    if "jitter" in facts:
        lines.append(f"  jitter   {told(facts['jitter'])}")
    if "unknown" in facts:
        lines.append(f"  unknown  {facts['unknown']} times")
    return lines
