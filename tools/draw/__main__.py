"""Draw an SVG file with a plotter: lines on its wall, sorted, as G-code."""

import argparse
import json
import re
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any

from fresa_host.vplotter import BAUD

from ..console import (
    Parser,
    Progress,
    UserError,
    check_outputs,
    command,
    say,
    warn,
    whole,
    write_files_atomically,
)
from ..cut_picture import duration
from ..picture import encode
from .program import MOST_DWELL_S, MOST_MM, MOST_SPEED

__all__ = ["main", "report"]

ABOUT = """\
Brings a drawing, FILE.svg, onto the wall of a hanging plotter: every shape by its outline, as large
as the wall allows or as large as you say, each pen's part in an order with little travel. Prints
how long the lines are and about how long it takes; writes what you ask for: G-code, a picture, the
commands of the plotter's first firmware; or sends it to the machine. With --simulate it is drawn on
the machine's gateware first, by simulation, with the strings and the pen that hangs from them.

A pen has one width, so fills are not filled. What no pen can draw is refused or named: text must be
paths (in Inkscape: Path > Object to Path); images, clipping, masks, filters and dashes are left out
with a note.
"""

EPILOG = """\
The pulleys are at the upper corners of the wall, and lengths are in mm. Places, X,Y, are from the
upper left corner, y down; in the G-code y goes up, from the lower left corner. The area that is
drawn on begins --top below the pulleys: nearer to them a step of a string moves the pen farther.

examples:
  python -m tools.draw flower.svg
      Say how large it becomes on the wall, how long its lines are, and how long it takes.

  python -m tools.draw flower.svg --out flower.gcode --png flower.png
      Write the program, and a picture of the wall with it.

  python -m tools.draw map.svg --pens colour --out map.gcode
      A pen for each colour of strokes. Between them the program waits (M0) for the next pen.

  python -m tools.draw card.svg --own-size --at 500,700 --out card.gcode
      As large as in the file, its upper left corner 500 mm from the left and 700 mm from the top.

  python -m tools.draw flower.svg --simulate --png flower.png
      Let the gateware draw it, and say how far its pen is from the drawing at most, where, and how
      long the machine takes; the picture shows what it has drawn, and that place magnified.

  python -m tools.draw flower.svg --simulate --bowed --string-rate 1500 --png flower.png
      Let the gateware draw it as the first firmware did, by the commands that --original writes:
      each string at a constant speed. Says how far lines are bowed, and how far the strings are
      from what such lines should be. It homes before, which takes most of the time.

  python -m tools.draw flower.svg --to /dev/ttyUSB0 --home
      Home the plotter, and draw. Ctrl-C, or p and Return, holds; Return goes on; Ctrl-C again, or
      q and Return, ends with the pen raised.

exit status: 0 if all is done, 1 if the machine cannot go on or its simulation draws anything else,
2 if the drawing or the port is not right, or there is no C++ compiler for --simulate, 130 if you
ended it.
"""


SPEEDS = {"feed": (1800.0, "speed with the pen down, mm/min"),
          "rapid": (2400.0, "speed with the pen up, mm/min, for the estimate"),
          "acceleration": (100.0, "acceleration, mm/s^2, for the estimate")}
"""Defaults of options: a pulley's motor does about a thousand half-steps a second."""

STRING_RATE, MOST_STRING_RATE = 400, 4000
"""Half steps a second: what a machine has by default, and with which the simulation sees an end
switch open before the next step."""

@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    args = _parser().parse_args(argv)
    check_outputs(args.file, pictures=[args.png], others=[args.out, args.original, args.json])
    if args.home and args.to is None:
        raise UserError("--home is that of --to")
    try:
        from .svg import read_drawing
    except ModuleNotFoundError as error:
        raise UserError(f"{error.name} is missing: pip install -e '.[draw]'") from error
    from .plan import plan
    from .timing import Speeds
    from .wall import Wall

    bowed = _bowed(args)
    wall = Wall(*args.wall, top=args.top, margin=args.margin, rest=args.rest)
    speeds = Speeds(args.feed, args.rapid, args.acceleration, dwell=args.dwell)
    settings = _simulated_machine(wall, speeds, bowed) if args.simulate else None
    with Progress(1, "files", f"reading {args.file.name}"):
        drawing = read_drawing(args.file)
    if notes := drawing.notes():
        warn(f"not as it looks: {notes}")
    planned = plan(
        drawing, wall, pens=args.pens, tolerance=args.tolerance, width=args.width,
        scale=1.0 if args.own_size else None, at=args.at, effort=args.effort,
        vpype=_uses_vpype(args.sort), progress=Progress)
    files = _programs(planned, args)
    facts = {"file": str(args.file), **planned.facts(speeds)}
    lines, done = report(facts, estimate=not bowed), None  # bowed lines have a speed of their own
    if settings is not None:
        done = _simulate(planned, settings, speeds)
        if done is None:
            return 1
        facts["simulated"] = done.facts()
        lines += done.report()
    files |= _pictures(planned, facts, lines, args, done)
    write_files_atomically(files)
    for line in lines:
        say(line)
    for path in files:
        say(f"wrote {path}")
    if done is not None and not done.right:
        return 1
    return _send(planned, args) if args.to is not None else 0


def report(facts: dict[str, Any], *, estimate: bool = True) -> list[str]:
    """Describe a drawing in a few lines, of its facts, with an estimate of its time or without."""
    where = facts["drawing_mm"]
    pens = facts["pens"]
    before, after = facts["up_as_in_file_mm"], facts["up_mm"]
    change = f", {1 - after / before:.0%} less" if after < before else ""
    twice = f"; {_count(facts['twice'], 'line')} drawn once, not twice" if facts["twice"] else ""
    lines = [
        f"{where['width']:.1f} x {where['height']:.1f} mm on the wall, from "
        f"{where['left']:.1f},{where['top']:.1f} on; {where['scale']:.4g} times its own size",
        f"{_count(facts['lines'], 'line')}, {_metres(facts['down_mm'])} with the pen down{twice}",
        f"{_metres(after)} with the pen up, {_metres(before)} in the order of the file{change} "
        f"({facts['sorted_by']})",
        *(f"pen {number}: {pen['name']}, {_count(pen['lines'], 'line')}, "
          f"{_metres(pen['down_mm'])}" for number, pen in enumerate(pens, 1) if len(pens) > 1),
    ]
    if estimate:
        lines.append(
            f"about {duration(facts['seconds'])}, {duration(facts['seconds_down'])} of it with the "
            "pen down: an estimate of speed along the path"
            + (", without the changes of pens" if len(pens) > 1 else ""))
    return lines


def _bowed(args: argparse.Namespace) -> int:
    """Return the half steps a second of bowed lines, 0 if they are straight."""
    if not args.bowed:
        if args.string_rate is not None:
            raise UserError("--string-rate is that of --bowed")
        return 0
    if not args.simulate:
        raise UserError("--bowed is how --simulate draws; add it, or build the machine so: "
                        "python -m tools.build --machine vplotter --bowed")
    if args.to is not None:
        raise UserError("--to sends G-code, of which lines are straight: leave out --bowed")
    if args.dwell:
        raise UserError("--bowed draws by commands of the first firmware, which have no --dwell")
    return args.string_rate or STRING_RATE


def _simulated_machine(wall: Any, speeds: Any, bowed: int) -> Any:
    """Return the machine that is to be simulated, if it can be: before all that takes long."""
    from tb.engines import choose

    from .simulation import settings_of

    choose("cxxrtl")  # raises what is to be installed
    return settings_of(wall, speeds, bowed)


def _simulate(planned: Any, settings: Any, speeds: Any) -> Any:
    """Draw in simulation, if the machine does not give up."""
    from fresa_host.errors import MachineError

    from ..gcode.sender import FaultShown
    from . import bowed, simulated

    try:
        if settings.bowed:
            return bowed.simulated(planned, settings)
        return simulated.simulated(planned, settings, speeds)
    except (MachineError, FaultShown) as error:
        say(f"simulated: {error}")
        return None


def _programs(planned: Any, args: argparse.Namespace) -> dict[Path, bytes]:
    """Return the programs that are asked for, by their files: before all that takes long."""
    from .program import gcode, original

    files = {}
    if args.out is not None:
        text = gcode(planned.parts, planned.wall, args.feed, args.dwell)
        files[args.out] = text.encode("ascii")
    if args.original is not None:
        paths = [args.original]
        if len(planned.parts) > 1:
            paths = [args.original.with_stem(f"{args.original.stem}-{number}")
                     for number in range(1, len(planned.parts) + 1)]
        check_outputs(args.file, pictures=[args.png], others=[args.out, args.json, *paths])
        files |= {path: original(part, planned.wall).encode("ascii")
                  for path, part in zip(paths, planned.parts, strict=True)}
    return files


def _pictures(planned: Any, facts: dict[str, Any], lines: list[str], args: argparse.Namespace,
              done: Any) -> dict[Path, bytes]:
    """Return the picture and the figures that are asked for, by their files."""
    from .picture import draw_wall

    files = {}
    if args.png is not None:
        with Progress(1, "pictures", "drawing the wall"):
            about = [line for line in lines if not line.startswith("pen ")]  # drawn anyway
            files[args.png] = encode(draw_wall(
                planned.parts if done is None else done.pictured(planned.parts), planned.wall,
                args.file.name, about,
                *(() if done is None else (done.done, done.worst))))
    if args.json is not None:
        files[args.json] = (json.dumps(facts, indent=2) + "\n").encode()
    return files


def _send(planned: Any, args: argparse.Namespace) -> int:
    """Draw on the wall."""
    from fresa_host import MachineError, VPlotter

    from ..keyboard import Ended
    from .program import sections
    from .send import send

    made = sections(planned.parts, planned.wall, args.feed, args.dwell)
    try:
        took = send(made, lambda: VPlotter(args.to, baud=args.baud), planned.wall, home=args.home)
    except Ended:
        say("ended: the machine stands, with the pen raised")
        return 130
    except MachineError as error:
        say(str(error))
        return 1
    say(f"drawn in {duration(took)}")
    return 0


def _uses_vpype(sort: str | None) -> bool | None:
    from .order import vpype_missing

    if sort == "vpype" and (missing := vpype_missing()):
        raise UserError(missing)
    return None if sort is None else sort == "vpype"


def _metres(mm: float) -> str:
    return f"{mm / 1000:.2f} m" if mm >= 1000 else f"{mm:.0f} mm"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _between(least: float, most: float) -> Callable[[str], float]:
    """Make a type for an argument that is a number from `least` to `most`."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not (isfinite(value) and least <= value <= most):
            raise argparse.ArgumentTypeError(
                f"must be a number from {least:g} to {most:g}, not {text!r}")
        return value

    return number


def _pair(separator: str, example: str, least: float) -> Callable[[str], list[float]]:
    """Make a type for an argument of two numbers."""
    limited = _between(least, MOST_MM)

    def numbers(text: str) -> list[float]:
        words = re.split(f"[{separator}]", text)
        if len(words) != 2:
            raise argparse.ArgumentTypeError(f"must be such as {example}, not {text!r}")
        return [limited(word) for word in words]

    return numbers


def _wall(text: str) -> list[float]:
    """Return width and height, of one number or two."""
    return _pair("xX", "1768x1768", 1)(text if re.search("[xX]", text) else f"{text}x{text}")


def _place(text: str) -> complex:
    """Return a place on the wall."""
    return complex(*_pair(",", "500,700", 0)(text))


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="python -m tools.draw", description=ABOUT, epilog=EPILOG)
    length = _between(0, MOST_MM)
    parser.add_argument("file", metavar="FILE.svg", type=Path, help="drawing; also .svgz")
    group = parser.add_argument_group("output")
    group.add_argument("--out", metavar="FILE", type=Path, help="write G-code")
    group.add_argument("--png", metavar="FILE", type=Path, help="draw the wall with it")
    group.add_argument("--json", metavar="FILE", type=Path, help="write the figures")
    group.add_argument("--simulate", action="store_true",
                       help="draw on the gateware first, and compare; building the machine takes "
                            "some ten seconds, once for each wall")
    group.add_argument("--bowed", action="store_true",
                       help="with --simulate: draw by the commands of the first firmware, on a "
                            "machine that is built with --bowed: straight lines are bowed")
    group.add_argument("--string-rate", metavar="N", type=whole(1, MOST_STRING_RATE),
                       help="half steps a second of --bowed, and of the homing cycle before it "
                            f"(default: {STRING_RATE})")
    group.add_argument("--original", metavar="FILE", type=Path,
                       help="write the commands of the first firmware (:I, :F), in whole mm; of "
                            "several pens, a file each: FILE-1, FILE-2")
    group = parser.add_argument_group("place on the wall")
    group.add_argument("--wall", metavar="WIDTH[xHEIGHT]", type=_wall, default=[1768.0, 1768.0],
                       help="size of the wall, mm (default: 1768, a square)")
    group.add_argument("--top", metavar="MM", type=length, default=200.0,
                       help="begin so far below the pulleys (default: 200)")
    group.add_argument("--margin", metavar="MM", type=length, default=100.0,
                       help="left free at the left, at the right and below (default: 100)")
    size = group.add_mutually_exclusive_group()
    size.add_argument("--width", metavar="MM", type=_between(0.001, MOST_MM),
                      help="width of the drawing (default: as large as it fits)")
    size.add_argument("--own-size", action="store_true", help="as large as the file has it")
    group.add_argument("--at", metavar="X,Y", type=_place,
                       help="upper left corner of the drawing (default: in the middle)")
    group.add_argument("--rest", metavar="X,Y", type=_place,
                       help="where the pen is before and after (default: the middle of the wall)")
    group = parser.add_argument_group("lines")
    group.add_argument("--pens", choices=["layer", "colour", "one"],
                       help="a pen for each layer (of Inkscape, or else group at the top), for "
                            "each colour of strokes, or one for all (default: layer if the file "
                            "has layers of Inkscape, one if not)")
    group.add_argument("--tolerance", metavar="MM", type=_between(0.001, 10), default=0.1,
                       help="how far a line on the wall may be from the curve (default: 0.1)")
    group.add_argument("--sort", choices=["vpype", "own"],
                       help="what merges and sorts lines (default: vpype where it is installed)")
    group.add_argument("--effort", metavar="N", type=_between(0, 3600), default=10.0,
                       help="about the seconds that two-opt may take for a pen (default: 10)")
    group = parser.add_argument_group("plotter")
    for name, (default, about) in SPEEDS.items():
        group.add_argument(f"--{name}", metavar="N", type=_between(1, MOST_SPEED), default=default,
                           help=f"{about} (default: {default:g})")
    group.add_argument("--dwell", metavar="S", type=_between(0, MOST_DWELL_S), default=0.0,
                       help="seconds that the pen takes to go down or up (default: 0)")
    group.add_argument("--to", metavar="PORT",
                       help="send it: /dev/ttyUSB0, COM3, socket://127.0.0.1:4000")
    group.add_argument("--baud", metavar="N", type=whole(300, 10_000_000), default=BAUD,
                       help=f"bits a second of the line (default: {BAUD})")
    group.add_argument("--home", action="store_true", help="home the machine before it draws")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
