"""Write the sources of a machine's bitstream, a report, and a picture of what it cuts."""

import argparse
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from amaranth.back import rtlil
from PIL import Image

from fresa.machines.mill import BAUD, CLOCK, PIXEL_STEPS, RESOLUTION, TOP_SPEED, Mill, MillPace
from fresa.motion import CoordinateGenerator, SerialOrders, SquareGenerator
from fresa_boards.nexys2 import Capacity, Nexys2_1200Platform, Nexys2Platform
from fresa_boards.nexys2_mill import Nexys2Mill, OrderSource, debounce_period, mill_ports
from fresa_boards.verilog import from_rtlil
from tb.boards import nexys2_mill
from tb.engines import ENGINES

from .console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    command,
    say,
    write_folder_atomically,
)
from .cut_picture import draw_cut
from .image import add_picture_arguments, picture_from_arguments
from .picture import Prepared, encode
from .simulate import EXAMPLE, report, simulate, step_rate
from .synthesis import PASSES, Resources, synthesise

__all__ = ["BOARDS", "MACHINES", "Built", "build_mill", "main"]

MACHINES = ("mill",)
BOARDS = {"nexys2-500": Nexys2Platform, "nexys2-1200": Nexys2_1200Platform, "pins": None}

SQUARE_SIDE = 20 * PIXEL_STEPS
"""Side of the square that BTN1 walks, in steps: 11 mm, the thesis gives none."""

ABOUT = """\
Writes a folder with everything that Xilinx ISE 14.7 needs to make a bitstream for a Nexys 2 that
mills your picture, and a picture of what it will cut, made by running that same gateware.

  mill.v  mill.ucf  mill.prj  mill.xst   the design, its pins, what XST does with it
  build.sh  build.bat                    run one of them where ISE is: two bitstreams come out, one
                                         to load over USB, one for the platform flash
  picture.png  cut.png                   what was asked; what the gateware mills in simulation
  report.json                            the figures that are printed

With --board pins it is mill.v and report.json alone: the raw machine with the pins of the thesis,
for other boards and for simulators.
"""

EPILOG = """\
examples:
  python -m tools.build
      The mill for the Nexys 2 with the XC3S500E, and the example picture, into
      build/mill-nexys2-500.

  python -m tools.build --image photo.jpg --size 200x200 --thin -o build/photo
      Prepare a photograph as python -m tools.image does, and build it in.

  python -m tools.build --board nexys2-1200 --image logo.png --step-rate 80
      The other Nexys 2, with motors that follow no more than 80 steps a second.

  python -m tools.build --orders square
      The thesis's first test: BTN1 walks the four corners of a square in the air.

  python -m tools.build --orders serial
      Orders come over the RS-232 port: python -m tools.send JOB streams pictures to it, of any
      number of pixels and without a new bitstream for each.

  python -m tools.build --board pins -o build/pins --no-report
      mill.v alone, at once.

  python -m tools.build --guard
      A machine that watches itself: where a position may be wrong it stops and shows an error. See
      python -m tools.faults flips --help for what that is worth.
"""


@dataclass(frozen=True)
class Built:
    """What was built.

    Attributes
    ----------
    files : mapping of str to bytes
        The sources, by name.
    rtlil : str
        The same design for Yosys.
    top : str
        Name of the top module.
    """

    files: Mapping[str, bytes]
    rtlil: str
    top: str


def build_mill(board: str, *, pace: MillPace, picture: Prepared | None = None,
               guard: bool = False, serial: bool = False) -> Built:
    """Make the sources of the mill.

    Parameters
    ----------
    board : str
        One of `BOARDS`.
    pace : MillPace
        Times, in clocks.
    picture : Prepared, optional
        What to mill. Without one a board walks a square; the raw machine has no order source.
    guard : bool
        Make position errors visible, see :class:`Mill`.
    serial : bool
        Orders come over the RS-232 port of the board instead.
    """
    platform_class = BOARDS[board]
    if platform_class is None:
        text = rtlil.convert(Mill(pace=pace, guard=guard), name="mill", emit_src=False)
        return Built({"mill.v": from_rtlil(text).encode()}, text, "mill")

    def source() -> OrderSource:
        if serial:
            return SerialOrders(clock=CLOCK, baud=BAUD)
        if picture is None:
            return SquareGenerator(side=SQUARE_SIDE)
        return CoordinateGenerator(picture.pixels.tolist(), pixel_steps=PIXEL_STEPS)

    platform = platform_class()
    top = Nexys2Mill(mill_ports(platform, serial=serial), source=source(), pace=pace, guard=guard)
    plan = platform.prepare(top, "mill")
    files = {name: text.encode() if isinstance(text, str) else text
             for name, text in plan.files.items()}
    if picture is not None:
        files["picture.png"] = encode(Image.fromarray(~picture.pixels))
    # The same wiring on plain ports, for Yosys: from Verilog it reads a picture in a minute.
    design = nexys2_mill(source(), pace=pace, debounce=debounce_period(), guard=guard)
    ports = [design.clk, *design.inputs.values(), *design.outputs.values()]
    text = rtlil.convert(design.top, name="mill", ports=ports, emit_src=False)
    return Built(files, text, "mill")


def check_memory(picture: Prepared, capacity: Capacity, board: str) -> None:
    """Refuse a picture that the FPGA cannot hold twice.

    Raises
    ------
    UserError
        If it takes more block RAMs than there are.
    """
    needed = 2 * -(-picture.pixels.size // 2**14)
    if needed > capacity.block_rams:
        raise UserError(
            f"{picture.width} x {picture.height} pixels take {needed} block RAMs and {board} has "
            f"{capacity.block_rams}: make the picture smaller, for instance --size 400x400")


def left_over(folder: Path, files: Mapping[str, bytes]) -> list[Path]:
    """List what an earlier build wrote into a folder and this one does not write.

    Only what that build's own report names counts: other files are somebody's.
    """
    try:
        earlier = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        names = {*map(str, earlier["files"]), *(["cut.png"] if "cut" in earlier else [])}
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [folder / name for name in sorted(names - set(files)) if Path(name).name == name]


def keep_picture(image: Path, places: Iterable[Path]) -> None:
    """Refuse to write over the picture, or to remove it.

    Raises
    ------
    UserError
        If it is in one of the places.
    """
    for place in places:
        if place.exists() and image.exists() and place.samefile(image):
            raise UserError(f"{image} would be written over: build into another folder with -o")


def figures(board: str, pace: MillPace, asked: Fraction, files: Mapping[str, bytes]) -> dict:
    """List what is known without synthesis, ready for JSON."""
    real = Fraction(CLOCK, pace.period)
    return {
        "machine": "mill",
        "board": board,
        "files": sorted(files),
        "clock_hz": CLOCK,
        "step_rate_asked": float(asked),
        "step_period_clocks": pace.period,
        "step_rate": round(float(real), 6),
        "mm_per_minute": round(float(real * RESOLUTION * 60), 4),
    }


def resource_lines(resources: Resources, capacity: Capacity) -> list[str]:
    """Say what a design takes, and of how much."""
    return [
        f"{name.replace('_', ' '):<12}{getattr(resources, name):>6} of {has:>6}  "
        f"{getattr(resources, name) / has:6.1%}"
        for name, has in vars(capacity).items()
    ]


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    args = _parser().parse_args(argv)
    if args.board == "pins" and (args.image or args.orders):
        raise UserError("the raw machine has no order source: leave out --image and --orders")
    if args.orders in ("square", "serial") and args.image:
        raise UserError(f"--orders {args.orders} has no picture built in: leave out --image")
    with_picture = args.board != "pins" and args.orders in (None, "image")
    args.image = args.image or EXAMPLE
    picture = picture_from_arguments(args) if with_picture else None
    capacity = (BOARDS[args.board] or Nexys2Platform).capacity
    if picture is not None:
        check_memory(picture, capacity, args.board)
    folder = args.output or Path("build", f"{args.machine}-{args.board}")
    pace = MillPace.real(step_rate=args.step_rate)

    built = build_mill(args.board, pace=pace, picture=picture, guard=args.guard,
                       serial=args.orders == "serial")
    facts = figures(args.board, pace, args.step_rate, built.files) | {"guard": args.guard}

    def write(extra: Mapping[str, bytes]) -> None:
        text = (json.dumps(facts, indent=2) + "\n").encode()
        write_folder_atomically(folder, {**extra, "report.json": text})

    old = left_over(folder, built.files)
    written = (folder / name for name in (*built.files, "report.json", "cut.png"))
    keep_picture(args.image, [*old, *written])
    write(built.files)
    for path in old:
        path.unlink(missing_ok=True)
    say(f"wrote {folder}: {', '.join(facts['files'])}")
    say(f"clock {CLOCK / 1e6:g} MHz; {facts['step_rate']:g} steps/s, one in {pace.period} clocks; "
        f"{facts['mm_per_minute']:g} mm/min")
    status = 0
    if args.report:
        with Progress(PASSES, "passes", f"counting resources{FIRST_TIME}") as progress:
            resources = synthesise(built.rtlil, built.top, progress.advance)
        facts |= {"resources": resources.facts(), "capacity": vars(capacity)}
        write({})
        for line in resource_lines(resources, capacity):
            say(line)
        say(f"counted by {resources.tool}")
        if picture is not None:
            cut = simulate(picture, engine=args.engine, guard=args.guard)
            facts["cut"] = {**cut.facts(), "job_seconds": round(cut.job_seconds(args.step_rate), 3)}
            write({"cut.png": encode(draw_cut(cut, args.step_rate))})
            say(report(cut, args.step_rate))
            say(f"wrote {folder / 'cut.png'}")
            status = 0 if cut.right else 1
    if args.board != "pins":
        say(f"next: run {folder / 'build.sh'} (Windows: build.bat) where Xilinx ISE 14.7 is")
    return status


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="python -m tools.build", description=ABOUT, epilog=EPILOG)
    parser.add_argument("machine", metavar="MACHINE", nargs="?", choices=MACHINES, default="mill",
                        help=f"one of: {', '.join(MACHINES)} (default: %(default)s)")
    parser.add_argument("--board", metavar="NAME", choices=BOARDS, default="nexys2-500",
                        help=f"one of: {', '.join(BOARDS)} (default: %(default)s)")
    parser.add_argument("--image", metavar="FILE", type=Path,
                        help="picture to mill (default: examples/strawberry.png)")
    parser.add_argument("--orders", metavar="SOURCE", choices=("image", "square", "serial"),
                        help="what BTN1 starts: image (default) or square; or serial: orders come "
                             "over the RS-232 port")
    parser.add_argument("--step-rate", metavar="HZ", type=step_rate, default=TOP_SPEED,
                        help="most steps a second that the motors follow (default: 101.376)")
    parser.add_argument("--guard", action="store_true",
                        help="a second controller watches the first: a flip-flop that is upset "
                             "leads to an error, never to a wrong position; twice the logic")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path,
                        help="folder to write to (default: build/MACHINE-BOARD)")
    parser.add_argument("--no-report", dest="report", action="store_false",
                        help="write the sources alone: no count of resources, no simulated cut")
    parser.add_argument("--engine", metavar="NAME", choices=sorted(ENGINES),
                        help="what simulates the cut, see python -m tools.simulate --help")
    add_picture_arguments(parser)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
