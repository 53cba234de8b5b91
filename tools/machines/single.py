# amaranth: UnusedElaboratable=no

"""Building `single`: one motor behind a serial line."""

import argparse
from typing import Any

from fresa.machines import Single
from fresa.machines.mill import CLOCK
from fresa.machines.single import TOP_SPEED, TURN, SingleTiming
from fresa.motion import MAX_ACCELERATION
from fresa.protocol import BAUD
from fresa.protocol.frames import SPEEDS

from ..console import UserError, whole
from .job import BOARDS, Built, Job, Kind, on_board, raw

__all__ = ["SINGLE", "add_machine_options", "build_single", "machine_options"]

def build_single(board: str, *, timing: SingleTiming, unipolar: bool = False,
                 full_step: bool = False, ramp: int = 0, top_speed: int = TOP_SPEED) -> Built:
    """Make the sources of the machine.

    Parameters
    ----------
    board : str
        One of `BOARDS`.
    timing : SinglePace
        Times, in clocks.
    unipolar, full_step, ramp, top_speed
        See :class:`Single`.
    """
    machine = Single(timing=timing, unipolar=unipolar, full_step=full_step, ramp=ramp,
                     top_speed=top_speed)
    where = BOARDS[board]
    return raw("single", machine) if where is None else on_board(where, "single", machine)


def job(args: argparse.Namespace) -> Job:
    """Make what was asked for; see :class:`Kind`."""
    options = machine_options(args)
    try:
        timing = SingleTiming.real(baud=args.baud, turn=options.pop("turn"))
        built = build_single(args.board, timing=timing, unipolar=args.unipolar, **options)
    except ValueError as error:
        raise UserError(str(error)) from error
    baud = CLOCK / timing.bit
    facts = {
        "machine": "single", "board": args.board, "files": sorted(built.files),
        "clock_hz": CLOCK, "baud_asked": args.baud, "baud": round(baud, 3),
        "bit_clocks": timing.bit, "steps_a_turn": args.turn,
        "modulus_clocks": timing.modulus, "steps_in_it_at_1_rpm": timing.rate,
        "unipolar": args.unipolar, "full_step": args.full_step}
    says = (f"clock {CLOCK / 1e6:g} MHz; {baud:.0f} baud, {timing.bit} clocks a "
            f"bit; at 1 rpm {timing.rate} steps in {timing.modulus} clocks")
    if args.ramp:
        facts |= {"ramp_steps_per_s2": args.ramp, "top_speed_rpm": args.top_speed}
        says += f"; {args.ramp} steps/s² up to {args.top_speed} rpm"
    return Job(built, facts, says)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the machine's own options."""
    group = parser.add_argument_group("single")
    group.add_argument("--baud", metavar="N", type=whole(1), default=BAUD,
                       help="bits a second of the serial line (default: %(default)s)")
    add_machine_options(group)
    group.add_argument("--unipolar", action="store_true",
                       help="coil words for a unipolar motor instead of a bipolar one")


def add_machine_options(group: argparse._ArgumentGroup) -> None:
    """Add the options by which what is typed has another effect."""
    group.add_argument("--turn", metavar="STEPS", type=whole(1, 10_000), default=TURN,
                       help="steps of a turn of the motor, by which rpm are counted; in half steps "
                            "these are twice as many for the shaft's own rpm (default: "
                            "%(default)s)")
    group.add_argument("--ramp", metavar="N", type=whole(0, MAX_ACCELERATION), default=0,
                       help="speed up and slow down by N steps/s², so that a motor with a load can "
                            "follow; 0 for none (default: %(default)s)")
    group.add_argument("--top-speed", metavar="RPM", type=whole(1, SPEEDS - 1), default=TOP_SPEED,
                       help="with --ramp, the speed at which the ramp ends: a higher one is made "
                            "as this (default: %(default)s)")
    group.add_argument("--full-step", action="store_true",
                       help="full steps, both windings on, instead of half steps")


def machine_options(args: argparse.Namespace) -> dict[str, Any]:
    """Give these: ``turn`` for its timing, and the others for :class:`Single`.

    Raises
    ------
    UserError
        If they do not go together.
    """
    if args.top_speed != TOP_SPEED and not args.ramp:
        raise UserError("leave out --top-speed: without --ramp every speed is made")
    return {name: getattr(args, name) for name in ("turn", "full_step", "ramp", "top_speed")}


SINGLE = Kind(add_options, job)
