"""Show the Nexys 2 and its machine on a page; their gateware runs in simulation."""

import argparse
import asyncio
import sys
import webbrowser
from contextlib import nullcontext
from pathlib import Path

from fresa.machines.mill import TOP_SPEED, step_period
from tb.engines import ENGINES, AmaranthEngine, CXXRTLEngine, EngineError, choose, why_slow
from tb.milling import DEBOUNCE

from ..console import FIRST_TIME, Parser, Progress, UserError, command, say, warn, whole
from ..image import add_picture_arguments, picture_from_arguments
from ..simulate import EXAMPLE
from ..web import redirect, serve, stopping
from .board import Board
from .build import timing_of
from .messages import Job
from .orders import LONGEST_PERIOD
from .routes import board_site

__all__ = ["main"]

ABOUT = """\
Serves a page to this computer only: a Nexys 2 with its switches, buttons, LEDs and display, and
next to it the milling machine that it moves. The gateware of the board is simulated pin by pin.

It prints an address; open it in a browser. It works without a network. To mill the picture, put
SW7 on and press BTN1. The page can load another picture, run clock by clock or at full speed, and
record waveforms. Several pages may show the same board; Ctrl-C ends it.
"""

EPILOG = f"""\
examples:
  python -m tools.board
      The strawberry. Open the address that is printed.

  python -m tools.board --image photo.jpg --size 120x120 --open
      A photograph, prepared as python -m tools.image does; a browser is opened.

  python -m tools.board --step-rate {float(TOP_SPEED)} --port 8000
      The step rate of the real board, to watch it clock by clock; a fixed port.

steps:
  A real board takes {LONGEST_PERIOD} clocks per step. The simulation shortens this to
  {timing_of(CXXRTLEngine)[0]} clocks on cxxrtl, which makes millions of clocks a second, and to
  {timing_of(AmaranthEngine)[0]} on amaranth, which is always available and makes thousands: a
  picture then takes minutes. For the same reason each digit is multiplexed faster, and
  debouncing takes {DEBOUNCE} clocks. Nothing else differs from the board.
"""


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.board", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--image", metavar="FILE", type=Path, default=EXAMPLE,
                        help="picture to mill (default: examples/strawberry.png)")
    parser.add_argument("--port", metavar="N", type=whole(0, 65535), default=0,
                        help="port to listen on (default: any that is free)")
    parser.add_argument("--engine", metavar="NAME",
                        choices=sorted(name for name in ENGINES if ENGINES[name].can_trace),
                        help="cxxrtl or amaranth (default: the fastest available)")
    rate = parser.add_mutually_exclusive_group()
    rate.add_argument("--period", metavar="CLOCKS", type=whole(1, LONGEST_PERIOD),
                      help="clocks from step to step (default: see below)")
    rate.add_argument("--step-rate", metavar="HZ", type=_period_of, dest="period",
                      help="the same in steps per second, for a clock of 50 MHz")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    add_picture_arguments(parser)
    args = parser.parse_args(argv)

    try:
        choose(args.engine)
    except EngineError as error:
        raise UserError(str(error)) from error
    job = Job(picture_from_arguments(args).pixels, args.image.name, args.period)
    if note := why_slow(args.engine):
        warn(note)
    asyncio.run(_serve(job, args))
    return 0


async def _serve(job: Job, args: argparse.Namespace) -> None:
    """Serve until Ctrl-C."""
    with stopping() as stop:
        board = Board(job, args.engine)
        try:
            async with serve(board_site(board), args.port) as address:
                stopped = asyncio.create_task(stop.wait())
                say(address)
                if sys.stdout is not None:
                    sys.stdout.flush()
                with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
                    await asyncio.wait([stopped, board.built], return_when=asyncio.FIRST_COMPLETED)
                if board.built.done() and (failure := board.built.result()) is not None:
                    raise UserError(failure)
                with redirect(address) if args.open else nullcontext() as place:
                    if place is not None and not stop.is_set():
                        await asyncio.to_thread(webbrowser.open, place)
                    await stopped
        finally:
            await board.close()


def _period_of(text: str) -> int:
    try:
        period = step_period(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    if period > LONGEST_PERIOD:
        raise argparse.ArgumentTypeError(
            f"must be at least {float(TOP_SPEED)} steps/s, the machine's maximum, not {text!r}")
    return period


if __name__ == "__main__":
    raise SystemExit(main())
