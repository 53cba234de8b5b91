"""Subcommands `list`, `at` and `table`: the signals of a wave, their values and changes."""

import argparse
import os.path
import sys
from collections.abc import Iterator

import numpy as np

from ..console import UserError, colour, say
from . import names
from .options import Query, add_file, add_format, add_window, plain, print_json, print_rows
from .reader import Signal, Wave
from .trace import Trace, moments

__all__ = ["at", "list_signals", "table"]

DEEPEST = 30
"""Scopes deeper than this are not indented further."""

AT, LIST, TABLE = (
    "the values of signals at a time", "the signals as a tree, with their widths",
    "the changes of signals, a row each time")

LIST_EXAMPLES = """\
examples:
  python -m tools.wave list mill.vcd
      All signals.

  python -m tools.wave list mill.vcd '*.x.*'
      Signals whose path, or the end of it, matches a pattern.
"""

AT_EXAMPLES = """\
examples:
  python -m tools.wave at mill.vcd 1.23us ready error
      A time, and ends of signal paths.

  python -m tools.wave at mill.vcd 200clk 'axis_?' x.count --radix x.count=dec
      After the rising edge of clock 200: three axes and a counter.
"""

TABLE_EXAMPLES = """\
examples:
  python -m tools.wave table mill.vcd axis_x axis_y --from 20clk --to 1.5us
      The coil words in that interval. The first row holds the values at its start.

  python -m tools.wave table mill.vcd 'sequencer*state' | head
      The first states.
"""


def list_signals(subparsers) -> None:
    """Add the subcommand `list`."""
    parser = subparsers.add_parser("list", help=LIST, description=f"Shows {LIST}.",
                                   epilog=LIST_EXAMPLES)
    add_file(parser)
    parser.add_argument("glob", metavar="GLOB", nargs="?", help="only signals like this")
    parser.set_defaults(run=_list)


def at(subparsers) -> None:
    """Add the subcommand `at`."""
    parser = subparsers.add_parser("at", help=AT, description=f"Shows {AT}.", epilog=AT_EXAMPLES)
    add_file(parser)
    parser.add_argument("time", metavar="TIME", help="such as 12us, 1.5ms, 300clk")
    parser.add_argument("signals", metavar="SIGNAL", nargs="+", help="names or patterns")
    add_format(parser)
    parser.set_defaults(run=_at)


def table(subparsers) -> None:
    """Add the subcommand `table`."""
    parser = subparsers.add_parser("table", help=TABLE, description=f"Shows {TABLE}.",
                                   epilog=TABLE_EXAMPLES)
    add_file(parser)
    parser.add_argument("signals", metavar="SIGNAL", nargs="+", help="names or patterns")
    add_window(parser)
    add_format(parser)
    parser.set_defaults(run=_table)


def _list(args: argparse.Namespace) -> int:
    wave = Wave(args.file)
    signals = wave.signals if args.glob is None else names.matching(wave, args.glob)
    if args.glob is not None and not signals:
        raise UserError(f"{wave.path} has no signal like {args.glob!r}")
    if args.json:
        print_rows(({"path": signal.path, "bits": signal.bits, "kind": signal.kind}
                  for signal in signals), None)
        return 0
    rows = list(_tree(signals))
    width = min(max((len(name) for name, _ in rows), default=0), 60)
    for name, about in rows:
        say(f"{name:{width}}  {about}" if about else colour(name, 1, sys.stdout))
    return 0


def _tree(signals: list[Signal]) -> Iterator[tuple[str, str]]:
    """Yield a line for each scope and signal: its name, indented, and its width."""
    last: tuple[str, ...] = ()
    for signal in signals:
        same = len(os.path.commonprefix([last, signal.parts[:-1]]))
        for depth in range(same, len(signal.parts) - 1):
            yield "  " * min(depth, DEEPEST) + signal.parts[depth], ""
        about = signal.kind if not signal.bits or signal.kind == "event" else (
            f"{signal.bits} bit{'s' * (signal.bits > 1)}"
            + (", named" if signal.kind == "text" else ""))
        yield "  " * min(len(signal.parts) - 1, DEEPEST) + signal.name, about
        last = signal.parts


def _at(args: argparse.Namespace) -> int:
    query = Query.of(args)
    signals = names.several(query.wave, args.signals)
    time = min(query.timeline.ticks(args.time).__floor__(), query.wave.span[1])
    values = {signal: query.wave.trace(signal).at(time) for signal in signals}
    if args.json:
        print_json({**query.moment(time),
                  "values": {signal.path: plain(value) for signal, value in values.items()}})
        return 0
    say(query.timeline.text_with_clock(time))
    width = max(len(signal.path) for signal in signals)
    for signal, value in values.items():
        say(f"  {signal.path:{width}}  {query.radixes.text(signal, value)}")
    return 0


def _table(args: argparse.Namespace) -> int:
    query = Query.of(args)
    signals = names.several(query.wave, args.signals)
    traces = [query.wave.trace(signal) for signal in signals]
    window = query.timeline.window(args.start, args.end)
    if args.json:
        print_rows(({**query.moment(time), "values": {
            signal.path: plain(trace.value(row))
            for signal, trace, row in zip(signals, traces, rows, strict=True)
        }} for time, rows, _ in _changes(traces, *window)), None)
        return 0
    heads = names.heads(signals)
    widths = [max(len(head), _widest(query, signal, trace))
              for head, signal, trace in zip(heads, signals, traces, strict=True)]
    say(colour("  ".join([f"{'time':>12}", f"{'clk':>8}", *(
        f"{head:>{width}}" for head, width in zip(heads, widths, strict=True))]), 1, sys.stdout))
    for time, rows, changed in _changes(traces, *window):
        cells = []
        for place, row in enumerate(rows):
            text = query.radixes.text(signals[place], traces[place].value(row))
            text = f"{text:>{widths[place]}}"
            cells.append(text if changed[place] else colour(text, 2, sys.stdout))
        clock = int(query.timeline.clocks(time)) if len(query.timeline.rises) else ""
        say("  ".join([f"{query.timeline.text(time):>12}", f"{clock:>8}", *cells]))
    return 0


def _changes(
    traces: list[Trace], start: int, end: int
) -> Iterator[tuple[int, list[int], list[bool]]]:
    """Yield each time of a change, the row of each trace, and which traces have changed."""
    last = [-2] * len(traces)
    for some in moments(traces, start, end):
        rows = np.array([trace.rows(some) for trace in traces]).T
        for time, row in zip(some.tolist(), rows.tolist(), strict=True):
            yield time, row, [new != old for new, old in zip(row, last, strict=True)]
            last = row


def _widest(query: Query, signal: Signal, trace: Trace) -> int:
    """Return the width of the widest value; numbers are as wide as their bits allow."""
    texts = [query.radixes.text(signal, word) for word in trace.words]
    if signal.kind in ("bits", "signed"):
        half = 1 << max(signal.bits - 1, 0)
        texts += [query.radixes.text(signal, half), query.radixes.text(signal, 2 * half - 1)]
    return max(map(len, texts), default=1)
