"""Subcommands `find` and `stats`: where a condition holds, and periods of signals."""

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..console import say
from . import names
from .expression import evaluate
from .options import LEFT, Query, add_file, add_format, add_window, print_json, print_rows
from .parser import parse
from .reader import Signal
from .trace import each

__all__ = ["find", "measured", "stats"]

FIND_ABOUT = """\
Prints the times at which a condition begins to hold, and for how long, or at which an event occurs.

  rise X, fall X, change X   events: X becomes true, becomes false, has another value
  == != < <= > >=            compare a number, or a name in quotes
  X[3], X[7:4]               bits of X;  & | ^ work on all bits
  and, or, not, ( )          join conditions; an event and a condition: the event while it holds
  unknown X                  a bit of X is neither 0 nor 1

Numbers are written 12, -3, 0x1F, 0b1100. A bit or a number by itself holds while it is not 0; an
unknown one is neither true nor false. Positions (at_x, x.count) and signals that --radix makes
signed go below 0. A signal name with special characters is quoted in backquotes.

Memory: some 50 MB, and up to six times the size of the file for the signals that the condition
names and the clock, if hardly anything else changes in it. Other signals take none.
"""

FIND_EXAMPLES = f"""\
examples:
  python -m tools.wave find mill.vcd 'rise ready'
      The times at which orders are done.

  python -m tools.wave find mill.vcd 'motion_state_state == "STRAIGHT"'
      A state is given with its code, STRAIGHT/7, or without.

  python -m tools.wave find mill.vcd 'rise step[0] and not direction[0]' --from 100clk | head
      Steps of X backwards.

exit status: 0 if a time is found, 1 if none is, 2 if the command is wrong,
{LEFT} if the output pipe is closed early, as head does.
"""

STATS_ABOUT = """\
Measures signals: edges, and minimum, mean and maximum of

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
    query = Query.of(args)
    condition = evaluate(node, query.wave, query.radixes)
    start, end = query.timeline.window(args.start, args.end)
    begins, ends = condition.stretches(query.wave.span[1])
    inside = (begins <= end) & (ends >= start if condition.event else (ends > start) | (
        begins >= start))
    begins, ends = begins[inside], ends[inside]

    def line(row: dict[str, Any]) -> str:
        clock = f"  {row['clock']:>8}clk" if "clock" in row else ""
        return f"{row['time']:>14}{clock}" + (
            "" if condition.event else f"  for {row['for']['time']}" + (
                f" ({row['for']['clock']}clk)" if clock else ""))

    rows = (query.moment(begin) | ({} if condition.event else {"for": {
        "seconds": float((stop - begin) * query.wave.tick),
        "time": query.timeline.text(stop - begin),
        **({"clock": int(query.timeline.clocks(stop) - query.timeline.clocks(begin))}
           if len(query.timeline.rises) else {}),
    }}) for begin, stop in each(begins, ends))
    print_rows(rows, None if args.json else line)
    return 0 if len(begins) else 1


def _stats(args: argparse.Namespace) -> int:
    query = Query.of(args)
    signals = names.several(query.wave, args.signals)
    window = query.timeline.window(args.start, args.end)
    if not args.json:
        clock = query.timeline.clock
        period = query.timeline.period
        say(f"from {query.timeline.text(window[0])} to {query.timeline.text(window[1])}" + (
            f", clock {clock.path} of {query.timeline.text(period)}" if clock and period else
            ", no clock"))
    facts = (measured(query, signal, *window) for signal in signals)
    if args.json:
        print_json(list(facts))
        return 0
    for fact in facts:
        say("\n".join(_lines(query, fact)))
    return 0


def measured(query: Query, signal: Signal, start: int, end: int) -> dict[str, Any]:
    """Measure a signal from a time to another, both in ticks.

    Returns
    -------
    dict
        Its path; ``changes``; of a single bit ``rises`` and ``falls``; and if there are enough
        edges ``period``, ``high`` and ``jitter``. The first two hold ``least``, ``mean`` and
        ``most``. Each time is a dict of ticks, seconds, and clocks if another signal is the clock.
    """
    trace = query.wave.trace(signal, keep=False)
    clock = query.timeline.clock
    clocked = len(query.timeline.rises) > 0 and clock is not None and clock.id != signal.id

    def inside(times: NDArray[np.int64]) -> NDArray[np.int64]:
        return times[np.searchsorted(times, start):np.searchsorted(times, end, side="right")]

    # The first value of a wave is not a change.
    marks = inside(trace.times if signal.kind == "event" else trace.times[1:])
    facts: dict[str, Any] = {"path": signal.path, "changes": len(marks)}
    if signal.bits == 1 and signal.kind == "bits":
        marks, falls = inside(trace.edges(rising=True)), inside(trace.edges(rising=False))
        facts |= {"rises": len(marks), "falls": len(falls)}
        # The falling edge after each rising one; the last ones may have none.
        after = np.searchsorted(falls, marks)
        whole = int(np.searchsorted(after, len(falls)))
        if whole:
            facts["high"] = _spread(query, marks[:whole], falls[after[:whole]], clocked)
    if len(marks) > 1:
        facts["period"] = _spread(query, marks[:-1], marks[1:], clocked)
        facts["jitter"] = {name: most - facts["period"]["least"][name]
                           for name, most in facts["period"]["most"].items()}
    if unknown := int(np.count_nonzero(trace.unknown)):
        facts["unknown"] = unknown
    return facts


def _spread(
    query: Query, begins: NDArray[np.int64], ends: NDArray[np.int64], clocked: bool
) -> dict[str, Any]:
    """Return minimum, mean and maximum of the durations from begins to ends."""
    sizes: dict[str, dict[str, Any]] = {"least": {}, "mean": {}, "most": {}}

    def note(name: str, apart: NDArray) -> None:
        for size, measure in zip(sizes.values(), (np.min, np.mean, np.max), strict=True):
            size[name] = measure(apart).item()

    note("ticks", ends - begins)
    for size in sizes.values():
        size["seconds"] = float(size["ticks"] * query.wave.tick)
    if clocked:
        note("clocks", query.timeline.clocks(ends) - query.timeline.clocks(begins))
    return sizes


def _lines(query: Query, facts: dict[str, Any]) -> Sequence[str]:
    """Format the measurements of a signal."""
    edges = f", {facts['rises']} rises, {facts['falls']} falls" if "rises" in facts else ""
    lines = [facts["path"], f"  changes  {facts['changes']}{edges}"]

    def with_clocks(size: dict[str, Any]) -> str:
        clocks = f" ({size['clocks']:.6g}clk)" if "clocks" in size else ""
        return query.timeline.text(size["ticks"]) + clocks

    for name in ("period", "high"):
        if name in facts:
            sizes = ", ".join(f"{kind} {with_clocks(size)}" for kind, size in facts[name].items())
            lines.append(f"  {name:7}  {sizes}")
    if "jitter" in facts:
        lines.append(f"  jitter   {with_clocks(facts['jitter'])}")
    if "unknown" in facts:
        lines.append(f"  unknown  {facts['unknown']} times")
    return lines
