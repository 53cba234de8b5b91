"""What the subcommands share: the file, its clock, how values are written, JSON."""

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

__all__ = ["LEFT", "Asked", "add_file", "add_format", "add_window", "plain", "say_json", "say_rows"]


LEFT = 141
"""Exit status if the reader of the output has left: that of SIGPIPE in a shell."""


@dataclass(frozen=True)
class Asked:
    """A wave, and how its times and values are written.

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
    def of(cls, args: argparse.Namespace) -> "Asked":
        """Open the file that is asked for."""
        wave = Wave(args.file)
        return cls(wave, Timeline(wave, args.clock), Radixes(wave, args.radix))

    def moment(self, ticks: int) -> dict[str, Any]:
        """Return a time for JSON: in seconds, in words, and in clocks if there are any."""
        known = {"seconds": float(ticks * self.wave.tick), "time": self.timeline.text(ticks)}
        if len(self.timeline.rises):
            known["clock"] = int(self.timeline.clocks(ticks))
        return known


def add_file(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that every subcommand has: the file, and JSON."""
    parser.add_argument("file", metavar="FILE", type=Path, help="a waveform: VCD, FST or GHW")
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def add_format(parser: argparse.ArgumentParser) -> None:
    """Add the clock and the radix."""
    parser.add_argument("--clock", metavar="NAME",
                        help="the clock (default: clk or clock, or else the bit that changes most)")
    parser.add_argument("--radix", metavar="NAME=hex", action="append", default=[],
                        help="write a signal as bin, hex, dec or signed; may be repeated")


def add_window(parser: argparse.ArgumentParser) -> None:
    """Add a stretch of time."""
    parser.add_argument("--from", metavar="TIME", dest="start", help="leave out what is before")
    parser.add_argument("--to", metavar="TIME", dest="end", help="leave out what is after")


def plain(value: Value) -> Value:
    """Return a value for JSON, which has no infinite numbers."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def say_json(answer: object) -> None:
    """Print an answer in JSON."""
    say(json.dumps(answer, indent=2))


def say_rows(rows: Iterable[dict], line: Callable[[dict], str] | None) -> None:
    """Print rows one by one as they come: as lines, or without `line` as a list in JSON."""
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
