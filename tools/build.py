"""Write the sources of a machine's bitstream, a report, and a picture of what it cuts."""

import argparse
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from fresa_boards.board import Capacity
from fresa_boards.nexys2 import NEXYS2_500
from tb.machines import machines

from .console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    command,
    say,
    write_folder_atomically,
)
from .machines import BOARDS, Kind, kinds
from .synthesis import PASSES, Resources, synthesise

__all__ = ["main"]

PROG = "python -m tools.build"

ABOUT = """\
Writes a folder with everything that Xilinx ISE 14.7 needs to make a bitstream for a Nexys 2.

  MACHINE.v  MACHINE.ucf  .prj  .xst     the design, its pins, what XST does with it
  pins.md                                which pin of the board is what, for people
  build.sh  build.bat                    run one of them where ISE is: two bitstreams come out, one
                                         to load over USB, one for the platform flash
  report.json                            the figures that are printed

machines:
{machines}

Of the mill, picture.png and cut.png are what was asked, and what it will cut, made by running that
same gateware.

With --board pins it is MACHINE.v and report.json alone: the raw machine, for other boards and for
simulators.
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


def resource_lines(resources: Resources, capacity: Capacity) -> list[str]:
    """Return what a design takes, and of how much."""
    return [
        f"{name.replace('_', ' '):<12}{getattr(resources, name):>6} of {has:>6}  "
        f"{getattr(resources, name) / has:6.1%}"
        for name, has in vars(capacity).items()
    ]


@command
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

    old = left_over(folder, built.files)
    if job.source is not None:
        written = (folder / name for name in (*built.files, "report.json", *job.shows))
        keep_picture(job.source, [*old, *written])
    write(built.files)
    for path in old:
        path.unlink(missing_ok=True)
    say(f"wrote {folder}: {', '.join(facts['files'])}")
    say(job.says)
    status = 0
    if args.report:
        capacity = (BOARDS[args.board] or NEXYS2_500).capacity
        with Progress(PASSES, "passes", f"counting resources{FIRST_TIME}") as progress:
            resources = synthesise(built.rtlil, built.top, progress.advance)
        facts |= {"resources": resources.facts(), "capacity": vars(capacity)}
        write({})
        for line in resource_lines(resources, capacity):
            say(line)
        say(f"counted by {resources.tool}")
        status = job.finish(write)
        for name in job.shows:
            say(f"wrote {folder / name}")
    if args.board != "pins":
        say(f"next: run {folder / 'build.sh'} (Windows: build.bat) where Xilinx ISE 14.7 is")
    return status


def _which(parser: argparse.ArgumentParser, known: Mapping[str, Kind]) -> argparse.ArgumentParser:
    parser.add_argument("--machine", metavar="NAME", choices=known, default=next(iter(known)),
                        help=f"one of: {', '.join(known)} (default: %(default)s); with --help "
                             "it shows the options of that machine")
    return parser


def _parser(machine: str, known: Mapping[str, Kind]) -> argparse.ArgumentParser:
    listed = "\n".join(f"  {name:<12} {each.about}" for name, each in machines().items())
    parser = _which(Parser(prog=PROG, machines=True, description=ABOUT.format(machines=listed),
                           epilog=EPILOG), known)
    parser.add_argument("--board", metavar="NAME", choices=BOARDS, default="nexys2-500",
                        help=f"one of: {', '.join(BOARDS)} (default: %(default)s)")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path,
                        help="folder to write to (default: build/MACHINE-BOARD, where you are)")
    parser.add_argument("--no-report", dest="report", action="store_false",
                        help="write the sources alone: no count of resources, no simulated cut")
    known[machine].add_options(parser)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
