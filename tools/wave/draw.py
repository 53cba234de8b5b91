"""Timing diagrams for documents, from waves."""

import argparse
import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from ..console import UserError, check_outputs, say, whole, write_atomically
from ..picture import encode
from . import names
from .figure import Axis, Row, figure
from .options import add_format, add_window, print_json
from .radix import Radixes, is_graph
from .reader import Wave, printable
from .scene import Scene
from .times import UNITS, Timeline

__all__ = ["MOST_ROWS", "draw", "draw_wave", "scene"]

ABOUT = """\
Draws a timing diagram for a document: SVG that follows light and dark pages, or PNG.

Bits are drawn as lines, buses as hexagons with values, states with their names, positions (x.count)
and signals named by --analog as curves. A word that ends in a colon is a heading. Unknown values
are red and hatched; where changes are too dense to be resolved, the row is grey.
"""

EXAMPLES = """\
examples:
  python -m tools.wave draw mill.vcd clk 'axis_?' ready -o mill.svg --to 40clk --cycles
      Forty clocks, counted at the bottom.

  python -m tools.wave draw mill.vcd inputs: start mode outputs: ready 'dut*.count' -o mill.png
      With headings, as a picture.

  python -m tools.wave draw mill.vcd segments leds -o m.svg --radix leds=hex --analog count
      Other radixes, and a curve.
"""

WIDTHS = (200, 10_000)
"""Widths in pixels allowed for a figure."""

_CODE = re.compile(r"(?<=[A-Z0-9])/\d+$")
"""A state name with its code, REST/0: the name is enough."""

MOST_ROWS = 200
"""Most rows of a figure: headings and signals, including those that a pattern matches."""


def draw_wave(subparsers) -> None:
    """Add the subcommand `draw`."""
    parser = subparsers.add_parser("draw", help="a timing diagram, SVG or PNG", description=ABOUT,
                                   epilog=EXAMPLES)
    parser.add_argument("file", metavar="FILE", type=Path, help="a waveform: VCD, FST or GHW")
    parser.add_argument("signals", metavar="SIGNAL", nargs="+",
                        help="names or patterns, and headings, which end in a colon: at "
                        f"most {MOST_ROWS} rows in all")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, required=True,
                        help="a name that ends in .svg or .png")
    add_window(parser)
    parser.add_argument("--cycles", action="store_true", help="count clocks instead of time")
    parser.add_argument("--width", metavar="PIXELS", type=whole(*WIDTHS), default=900,
                        help="width of the figure (default: %(default)s)")
    parser.add_argument("--title", metavar="TEXT", default="", help="title above the figure")
    parser.add_argument("--analog", metavar="NAME", action="append", default=[],
                        help="draw a curve; may be repeated")
    parser.add_argument("--json", action="store_true", help="print the result in JSON")
    add_format(parser)
    parser.set_defaults(run=_draw)


def scene(
    wave: Wave,
    signals: Sequence[str],
    start: str | None = None,
    end: str | None = None,
    *,
    clock: str | None = None,
    cycles: bool = False,
    width: int = 900,
    title: str = "",
    radix: Sequence[str] = (),
    analog: Sequence[str] = (),
) -> Scene:
    """Make a timing diagram of a wave.

    Parameters
    ----------
    wave : Wave
        The wave.
    signals : sequence of str
        Names and patterns of signals, and headings, which end in a colon.
    start, end : str, optional
        Times such as ``12us`` or ``300clk``; the whole wave without them.
    clock : str, optional
        Name of the clock, see `Timeline`.
    cycles : bool
        Whether to count clocks instead of time.
    width : int
        In pixels.
    title : str
        Text above the figure.
    radix : sequence of str
        Such as ``count=hex``.
    analog : sequence of str
        Names of signals that are drawn as curves.

    Raises
    ------
    UserError
        If there is no such signal, time or radix, or there are more rows than `MOST_ROWS`.
    """
    timeline, radixes = Timeline(wave, clock), Radixes(wave, radix)
    window = timeline.window(start, end)
    if window[0] == window[1] and start is not None and end is not None:
        raise UserError(f"from {start} to {end} is empty")
    rows = _rows(wave, signals, radixes, analog)
    drawn = ", ".join(row.name for row in rows if row.trace is not None)
    about = f"{drawn}, from {timeline.text(window[0])} to {timeline.text(window[1])}."
    return figure(rows, *window, _axis(timeline, window, cycles=cycles), width=width,
                  title=printable(title), about=about)


def draw(wave: Wave, signals: Sequence[str], start: str | None = None, end: str | None = None,
         **how) -> str:
    """Return a timing diagram as SVG; see `scene`."""
    return scene(wave, signals, start, end, **how).svg()


def _draw(args: argparse.Namespace) -> int:
    output = args.output
    kind = output.suffix.lower()
    if kind not in (".svg", ".png"):
        raise UserError(f"{output} is not a name that ends in .svg or .png")
    check_outputs(args.file, pictures=[], others=[output])
    wave = Wave(args.file)
    drawing = scene(wave, args.signals, args.start, args.end, clock=args.clock, cycles=args.cycles,
                    width=args.width, title=args.title, radix=args.radix, analog=args.analog)
    data = drawing.svg().encode() if kind == ".svg" else encode(drawing.picture())
    write_atomically(output, data)
    if args.json:
        print_json({"file": str(output), "width": drawing.width, "height": drawing.height,
                  "about": drawing.about})
    else:
        say(f"wrote {output}")
    return 0


def _rows(
    wave: Wave, wanted: Sequence[str], radixes: Radixes, analog: Sequence[str]
) -> list[Row]:
    """Find the signals, and how each is drawn."""
    curves = {signal.path for signal in names.several(wave, analog)}
    groups = [[name] if name.endswith(":") else names.several(wave, [name]) for name in wanted]
    signals = [item for group in groups for item in group if not isinstance(item, str)]
    if not signals:
        raise UserError("there are only headings to draw")
    if (count := sum(map(len, groups))) > MOST_ROWS:
        raise UserError(f"a figure has at most {MOST_ROWS} rows, signals and headings, not {count}")
    heads = dict(zip([signal.path for signal in signals], names.heads(signals), strict=True))
    rows = []
    for item in (item for group in groups for item in group):
        if isinstance(item, str):
            rows.append(Row(printable(item.removesuffix(":"))))
            continue
        number = item.kind in ("bits", "signed")
        name = ".".join(item.parts[-2:]) if is_graph(item) else heads[item.path]
        rows.append(Row(
            name.removesuffix("_state"), wave.trace(item),
            lambda value, item=item: _CODE.sub("", radixes.text(item, value, prefix=False)),
            signed=item.bits if number and radixes.of(item) == "signed" else 0,
            curve=item.kind == "real" or number and (item.path in curves or is_graph(item))))
    return rows


def _axis(timeline: Timeline, window: tuple[int, int], *, cycles: bool) -> Axis:
    if cycles:
        if not len(timeline.rises):
            raise UserError("there is no clock to count; --clock names one")
        return Axis("clocks", marks=timeline.rises)
    seconds = max(abs(time) for time in window) * timeline.wave.tick
    unit = next((unit for unit, exponent in UNITS.items()
                 if seconds >= Fraction(10) ** exponent), "fs")
    return Axis(unit, float(Fraction(10) ** UNITS[unit] / timeline.wave.tick))
