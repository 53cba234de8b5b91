"""Building `positioner`: three motors behind a serial line."""

import argparse
from typing import Any

from fresa.drive import MAX_PULSE
from fresa.machines import Positioner
from fresa.machines.mill import CLOCK
from fresa.machines.positioner import ENDS, LIMIT_ENDS, TOP_SPEED, PositionerTiming
from fresa.motion import MAX_BACKLASH
from fresa.protocol import BAUD, bit_period

from ..console import UserError, whole
from .job import BOARDS, Built, Job, Kind, on_board, raw

__all__ = ["POSITIONER", "add_machine_options", "build_positioner", "machine_options"]

LONGEST_NS = MAX_PULSE * 10**9 // CLOCK
"""Longest time of a driver module that can be counted."""

TIMES = {"width": (1900, "STEP is high"), "low": (1900, "STEP is low"),
         "setup": (650, "DIR is still before STEP"), "hold": (650, "DIR is still after STEP")}
"""Times of the driver modules: those of the DRV8825, and what they say."""


def build_positioner(board: str, *, timing: PositionerTiming, enable_low: bool = False,
                     normally_closed: bool = False, **options) -> Built:
    """Make the sources of the machine.

    Parameters
    ----------
    board : str
        One of `BOARDS`.
    timing : PositionerPace
        Times.
    enable_low : bool
        ENABLE gives power where it is low.
    normally_closed : bool
        The limit switches are closed, and their pins low, until they are pressed; a wire that is
        broken counts as pressed.
    options
        See :class:`Positioner`.

    Raises
    ------
    ValueError
        If something does not go together, or is of a board where there is none.
    """
    where = BOARDS[board]
    if where is None:
        if enable_low or normally_closed:
            raise ValueError("without a board the machine has no pins: invert enable and limits "
                             "where you wire it, not by --enable-low or --normally-closed")
        return raw("positioner", Positioner(timing=timing, **options))
    inverted = ["enable"] * enable_low + ["limits"] * normally_closed
    return on_board(where, "positioner", Positioner(timing=timing, **options), inverted)


def job(args: argparse.Namespace) -> Job:
    """Make what was asked for; see :class:`Kind`."""
    times = {f"{name}_ns": getattr(args, f"{name}_ns") for name in TIMES}
    options = machine_options(args)
    top_speed = options.pop("top_speed")
    options |= {"inverted": args.inverted, "enable_low": args.enable_low,
                "normally_closed": args.normally_closed}
    try:
        timing = PositionerTiming.real(baud=args.baud, top_speed=top_speed, **times)
        built = build_positioner(args.board, timing=timing, **options)
    except ValueError as error:
        raise UserError(str(error)) from error
    bit = bit_period(CLOCK, args.baud)
    facts = {
        "machine": "positioner", "board": args.board, "files": sorted(built.files),
        "clock_hz": CLOCK, "baud_asked": args.baud, "baud": round(CLOCK / bit, 3),
        "bit_clocks": bit, "top_speed": top_speed, **times, **options}
    return Job(built, facts, f"clock {CLOCK / 1e6:g} MHz; {CLOCK / bit:.0f} baud, {bit} clocks a "
                             f"bit; up to {top_speed} steps/s")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the machine's own options."""
    group = parser.add_argument_group("positioner")
    group.add_argument("--baud", metavar="N", type=whole(1), default=BAUD,
                       help="bits a second of the serial line, some 6 200 at least: a report and "
                            "an answer must fit into 0.1 s (default: %(default)s)")
    for name, (time, says) in TIMES.items():
        group.add_argument(f"--{name}-ns", metavar="NS", type=whole(1, LONGEST_NS), default=time,
                           help=f"least time for which {says} (default: %(default)s)")
    group.add_argument("--inverted", action="store_true",
                       help="STEP and DIR go through optocouplers that invert them")
    group.add_argument("--enable-low", action="store_true",
                       help="ENABLE gives power where it is low, as a DRV8825 without an inverter "
                            "wants it")
    group.add_argument("--normally-closed", action="store_true",
                       help="the limit switches open where they are pressed")
    add_machine_options(group)


def add_machine_options(group: argparse._ArgumentGroup) -> None:
    """Add the options by which lines, and limit switches, have another effect."""
    group.add_argument("--top-speed", metavar="N", type=whole(1), default=TOP_SPEED,
                       help="most steps a second of a motor (default: %(default)s)")
    group.add_argument("--backlash", metavar=("X", "Y", "Z"), nargs=3, type=whole(0, MAX_BACKLASH),
                       default=(0, 0, 0),
                       help="steps of backlash that each axis takes up at a reversal (default: 0 "
                            "0 0)")
    group.add_argument("--limit-ends", "--guards", metavar=("END1", "END2", "END3"), nargs=3,
                       choices=ENDS,
                       default=LIMIT_ENDS,
                       help=f"the end at which the switch of each limit input is, of "
                            f"{', '.join(ENDS)} (default: {' '.join(LIMIT_ENDS)})")


def machine_options(args: argparse.Namespace) -> dict[str, Any]:
    """Give these: ``top_speed`` for its timing, and the others for :class:`Positioner`."""
    return {"top_speed": args.top_speed, "backlash": tuple(args.backlash),
            "limit_ends": tuple(args.limit_ends)}


POSITIONER = Kind(add_options, job)
