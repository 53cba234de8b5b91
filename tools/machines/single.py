"""Building `single`: one motor behind a serial line."""

import argparse

from fresa.machines import Single
from fresa.machines.mill import CLOCK
from fresa.machines.single import TURN, SinglePace
from fresa.protocol import BAUD
from fresa_boards.nexys2_common import debounce_period
from fresa_boards.nexys2_single import Nexys2Single, single_ports
from tb.boards import nexys2_single

from ..console import UserError, whole
from .job import BOARDS, Built, Job, Kind, on_board, raw

__all__ = ["SINGLE", "build_single"]

SCAN_BITS = 17
"""A digit of the display has its turn for so many binary digits of clocks: 95 Hz for all four."""


def build_single(board: str, *, pace: SinglePace, unipolar: bool = False,
                 full_step: bool = False) -> Built:
    """Make the sources of the machine.

    Parameters
    ----------
    board : str
        One of `BOARDS`.
    pace : SinglePace
        Times, in clocks.
    unipolar, full_step : bool
        See :class:`Single`.
    """
    def machine() -> Single:
        return Single(pace=pace, unipolar=unipolar, full_step=full_step)

    platform_class = BOARDS[board]
    if platform_class is None:
        return raw("single", machine())
    platform = platform_class()
    debounce = debounce_period()
    top = Nexys2Single(single_ports(platform), machine=machine(), debounce=debounce,
                       scan_bits=SCAN_BITS)
    return on_board("single", platform, top, nexys2_single(
        machine(), debounce=debounce, scan_bits=SCAN_BITS))


def job(args: argparse.Namespace) -> Job:
    """Make what was asked for; see :class:`Kind`."""
    try:
        pace = SinglePace.real(baud=args.baud, turn=args.turn)
    except ValueError as error:
        raise UserError(str(error)) from error
    built = build_single(args.board, pace=pace, unipolar=args.unipolar, full_step=args.full_step)
    baud = CLOCK / pace.bit
    facts = {
        "machine": "single", "board": args.board, "files": sorted(built.files),
        "clock_hz": CLOCK, "baud_asked": args.baud, "baud": round(baud, 3),
        "bit_clocks": pace.bit, "steps_a_turn": args.turn,
        "modulus_clocks": pace.modulus, "steps_in_it_at_1_rpm": pace.rate,
        "unipolar": args.unipolar, "full_step": args.full_step}
    return Job(built, facts, f"clock {CLOCK / 1e6:g} MHz; {baud:.0f} baud, {pace.bit} clocks a "
                             f"bit; at 1 rpm {pace.rate} steps in {pace.modulus} clocks")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the machine's own options."""
    group = parser.add_argument_group("single")
    group.add_argument("--baud", metavar="N", type=whole(1), default=BAUD,
                       help="bits a second of the serial line (default: %(default)s)")
    group.add_argument("--turn", metavar="STEPS", type=whole(1, 10_000), default=TURN,
                       help="steps of a turn of the motor, by which rpm are counted; in half steps "
                            "these are twice as many for the shaft's own rpm (default: "
                            "%(default)s)")
    group.add_argument("--unipolar", action="store_true",
                       help="coil words for a unipolar motor instead of a bipolar one")
    group.add_argument("--full-step", action="store_true",
                       help="full steps, both windings on, instead of half steps")


SINGLE = Kind(add_options, job)
