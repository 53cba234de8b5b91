"""Options and output that the subcommands share: file, clock, radix, window, JSON."""

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..console import say
from .radix import Radixes
from .reader import Wave
from .times import Timeline
from .trace import Value

__all__ = ["LEFT", "Query", "add_file", "add_format", "add_window", "plain", "print_json",
           "print_rows"]


LEFT = 141
"""Exit status when the output pipe has been closed: that of SIGPIPE in a shell."""


@dataclass(frozen=True)
class Query:
    """A wave, its time line and the radixes of its signals, as the options of a command give them.

    Attributes
    ----------
    wave : Wave
        The wave.
    timeline : Timeline
        Its times and its clock.
    radixes : Radixes
        How values are written.
    """

    wave: Wave
    timeline: Timeline
    radixes: Radixes

    @classmethod
    def of(cls, args: argparse.Namespace) -> "Query":
        """Open the file of parsed arguments."""
        wave = Wave(args.file)
        return cls(wave, Timeline(wave, args.clock), Radixes(wave, args.radix))

    def moment(self, ticks: int) -> dict[str, Any]:
        """Return a time for JSON: in seconds, as text, and in clocks if there is a clock."""
        known = {"seconds": float(ticks * self.wave.tick), "time": self.timeline.text(ticks)}
        if len(self.timeline.rises):
            known["clock"] = int(self.timeline.clocks(ticks))
        return known


def add_file(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of every subcommand: the file, and JSON."""
    parser.add_argument("file", metavar="FILE", type=Path, help="a waveform: VCD, FST or GHW")
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def add_format(parser: argparse.ArgumentParser) -> None:
    """Add the options `--clock` and `--radix`."""
    parser.add_argument("--clock", metavar="NAME",
                        help="the clock (default: clk or clock, or else the bit that changes most)")
    parser.add_argument("--radix", metavar="NAME=hex", action="append", default=[],
                        help="write a signal as bin, hex, dec or signed; may be repeated")


def add_window(parser: argparse.ArgumentParser) -> None:
    """Add the options `--from` and `--to`."""
    parser.add_argument("--from", metavar="TIME", dest="start", help="start of the window")
    parser.add_argument("--to", metavar="TIME", dest="end", help="end of the window")


def plain(value: Value) -> Value:
    """Return a value for JSON, in which infinite numbers are text."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def print_json(answer: object) -> None:
    """Print a value in JSON."""
    say(json.dumps(answer, indent=2))


def print_rows(rows: Iterable[dict], line: Callable[[dict], str] | None) -> None:
    """Print rows as they come: with `line` as lines of text, otherwise as a list in JSON."""
    if line is not None:
        for text in map(line, rows):
            say(text)
        return
    for text in _listed(rows):
        if sys.stdout is not None:
            sys.stdout.write(text)


def _listed(rows: Iterable[dict]) -> Iterator[str]:
    comma = "[\n  "
    for row in rows:
        yield comma + json.dumps(row)
        comma = ",\n  "
    yield "[]\n" if comma.startswith("[") else "\n]\n"
