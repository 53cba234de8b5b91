"""Building the mill: a picture goes in, and the cut that it will make comes out."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

from PIL import Image

from fresa.clock import CLOCK
from fresa.machines import MillStation, SerialOrders
from fresa.machines.mill import (
    PICTURE_MAX,
    PIXEL_STEPS,
    RESOLUTION,
    TOP_SPEED,
    Mill,
    MillTiming,
)
from fresa.machines.station import OrderSource
from fresa.motion import CoordinateGenerator, SquareGenerator
from fresa.protocol import BAUD, bit_period
from fresa_boards.board import Capacity
from fresa_boards.nexys2 import NEXYS2_500
from tb.engines import ENGINES

from ..console import UserError, say
from ..cut_picture import draw_cut
from ..image import add_picture_arguments, picture_from_arguments
from ..picture import Prepared, encode
from ..simulate import EXAMPLE, report, simulate, step_rate
from .job import BOARDS, Built, Job, Kind, Write, on_board, raw

__all__ = ["KIND", "build_mill", "largest_square"]

SQUARE_SIDE = 20 * PIXEL_STEPS
"""Side of the square that start walks, in steps: 11 mm, the thesis gives none."""


def build_mill(board: str, *, timing: MillTiming, picture: Prepared | None = None,
               guard: bool = False, serial: bool = False) -> Built:
    """Make the sources of the mill.

    Parameters
    ----------
    board : str
        One of `BOARDS`.
    timing : MillTiming
        Times, in clocks.
    picture : Prepared, optional
        What to mill. Without one a board walks a square; the raw machine has no order source.
    guard : bool
        Make position errors visible, see :class:`Mill`.
    serial : bool
        Orders come over the serial port of the board instead.
    """
    where = BOARDS[board]
    if where is None:
        return raw("mill", Mill(timing=timing, guard=guard))
    source: OrderSource
    if serial:
        source = SerialOrders(period=bit_period(where.clock, BAUD))
    elif picture is None:
        source = SquareGenerator(side=SQUARE_SIDE)
    else:
        source = CoordinateGenerator(picture.pixels.tolist(), pixel_steps=PIXEL_STEPS)
    built = on_board(where, "mill", MillStation(source=source, timing=timing, guard=guard))
    if picture is None:
        return built
    return replace(built, files={**built.files,
                                 "picture.png": encode(Image.fromarray(~picture.pixels))})


def check_memory(picture: Prepared, capacity: Capacity, board: str) -> None:
    """Refuse a picture that the FPGA cannot hold twice.

    Raises
    ------
    UserError
        If it takes more block RAMs than there are.
    """
    needed = 2 * -(-picture.pixels.size // capacity.block_ram_bits)
    if needed > capacity.block_rams:
        raise UserError(
            f"{picture.width} x {picture.height} pixels take {needed} block RAMs and {board} has "
            f"{capacity.block_rams}: make the picture smaller, for instance --size "
            "{0}x{0}".format(largest_square(capacity)))


def largest_square(capacity: Capacity) -> int:
    """Return the side of a square picture that an FPGA holds, in tens of pixels, up to 400."""
    side = int((capacity.block_rams // 2 * capacity.block_ram_bits) ** 0.5) // 10 * 10
    return min(side, PICTURE_MAX)


def figures(board: str, clock: int, timing: MillTiming, asked: Fraction,
            files: Mapping[str, bytes]) -> dict:
    """List what is known without synthesis, ready for JSON."""
    real = Fraction(clock, timing.period)
    return {
        "machine": "mill",
        "board": board,
        "files": sorted(files),
        "clock_hz": clock,
        "step_rate_asked": float(asked),
        "step_period_clocks": timing.period,
        "step_rate": round(float(real), 6),
        "mm_per_minute": round(float(real * RESOLUTION * 60), 4),
    }


def job(args: argparse.Namespace) -> Job:
    """Make what was requested; see :class:`Kind`."""
    if args.board == "pins" and (args.image or args.orders):
        raise UserError("the raw machine has no order source: leave out --image and --orders")
    if args.orders in ("square", "serial") and args.image:
        raise UserError(f"--orders {args.orders} has no picture built in: leave out --image")
    with_picture = args.board != "pins" and args.orders in (None, "image")
    args.image = args.image or EXAMPLE
    where = BOARDS[args.board]
    capacity = (where or NEXYS2_500).capacity
    args.size = args.size or (largest_square(capacity),) * 2
    picture = picture_from_arguments(args) if with_picture else None
    if picture is not None:
        check_memory(picture, capacity, args.board)
    clock = where.clock if where else CLOCK
    try:
        timing = MillTiming.real(step_rate=args.step_rate, clock=clock)
    except ValueError as error:
        rate = args.step_rate  # of which the message has the repr, that of a Fraction
        raise UserError(str(error).replace(repr(rate), f"{float(rate):.12g}")) from error
    try:
        built = build_mill(args.board, timing=timing, picture=picture, guard=args.guard,
                           serial=args.orders == "serial")
    except ValueError as error:  # no pins for it
        raise UserError(str(error)) from error
    facts = figures(args.board, clock, timing, args.step_rate, built.files) | {
        "guard": args.guard, "orders": None if args.board == "pins" else args.orders or "image"}
    says = (f"clock {clock / 1e6:g} MHz; {facts['step_rate']:g} steps/s, one in {timing.period} "
            f"clocks; {facts['mm_per_minute']:g} mm/min")
    if picture is None:
        return Job(built, facts, says, source=args.image)

    def finish(write: Write) -> int:
        """Run that same gateware, and draw what it cuts."""
        cut = simulate(picture, engine=args.engine, guard=args.guard)
        facts["cut"] = {**cut.facts(), "job_seconds": round(cut.job_seconds(args.step_rate), 3)}
        write({"cut.png": encode(draw_cut(cut, args.step_rate))})
        say(report(cut, args.step_rate))
        return 0 if cut.right else 1

    return Job(built, facts, says, source=args.image, shows=("cut.png",), finish=finish)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the mill's own options."""
    group = parser.add_argument_group("the mill")
    group.add_argument("--image", metavar="FILE", type=Path,
                       help="picture to mill (default: examples/strawberry.png)")
    group.add_argument("--orders", metavar="SOURCE", choices=("image", "square", "serial"),
                       help="what start begins: image (default) or square; or serial: orders come "
                            "over the board's serial port")
    group.add_argument("--step-rate", metavar="HZ", type=step_rate, default=TOP_SPEED,
                       help="most steps a second that the motors follow (default: 101.376)")
    group.add_argument("--guard", action="store_true",
                       help="a second controller watches the first: a flip-flop that is upset "
                            "leads to an error, never to a wrong position; twice the logic")
    group.add_argument("--engine", metavar="NAME", choices=sorted(ENGINES),
                       help="what simulates the cut, see python -m tools.simulate --help")
    add_picture_arguments(parser)


KIND = Kind(add_options, job)
