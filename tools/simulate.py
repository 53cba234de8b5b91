"""Mill a picture in simulation, and draw the cut."""

import argparse
import json
from contextlib import ExitStack
from fractions import Fraction
from pathlib import Path

from fresa.machines.mill import RESOLUTION, TOP_SPEED, step_period
from tb.engines import ENGINES, EngineError, build_with_fallback, why_slow
from tb.milling import Cut, ready_to_mill, run_job

from .console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    check_outputs,
    command,
    say,
    staged,
    warn,
    write_files_atomically,
)
from .cut_picture import draw_cut, duration, strokes
from .image import add_picture_arguments, picture_from_arguments
from .picture import Prepared, encode

__all__ = ["EXAMPLE", "main", "report", "simulate", "step_rate"]

EXAMPLE = Path(__file__).parent.parent / "examples" / "strawberry.png"

ABOUT = """\
Simulates the gateware of the whole board on a picture, from the switches and buttons of the Nexys 2
to the coils of the motors, and draws the target picture and the cut.

The simulation sets SW7 and presses BTN1. Motors and tool are modelled by a plant, whose only inputs
are coil words; its cut must equal the picture, pixel for pixel, or the exit status is 1. Only the
time from step to step is shortened; the time of the job on the real machine is calculated.
"""

EPILOG = """\
examples:
  python -m tools.simulate
      Mill the example and draw it in cut.png.

  python -m tools.simulate --image photo.jpg --size 120x120 --png photo-cut.png
      Prepare a photograph as python -m tools.image does, and mill it.

  python -m tools.simulate --image logo.png --json logo.json --step-rate 50
      Write the figures; calculate the time at 50 steps per second.

  python -m tools.simulate --image tiny.png --vcd tiny.vcd --engine amaranth
      Write the waveform of the whole job, with names of states. It is large: some 300 bytes
      a clock. A picture of 8 x 8 pixels is enough.

engines:
  cxxrtl     the gateware as C++; needs a C++ compiler; millions of clocks a second
  amaranth   Amaranth's own simulator; always available; thousands of clocks a second
  verilator, icarus   the Verilog that is built, if one of these is installed
  netlist, netlist-icarus   the cells of the Spartan-3E, for pictures that take no block RAM
"""


def simulate(prepared: Prepared, *, engine: str | None = None, period: int = 1,
             vcd: Path | None = None, guard: bool = False) -> Cut:
    """Mill a picture, with a progress bar.

    Parameters
    ----------
    prepared : Prepared
        The picture.
    engine : str, optional
        Name of the engine; None for the fastest available.
    period : int
        Clocks per step in the simulation.
    vcd : path, optional
        Where to write a waveform, atomically.
    guard : bool
        Whether the machine has its guard, see :class:`fresa.machines.Mill`.

    Raises
    ------
    UserError
        If the engine does not exist or is not available.
    """
    with ExitStack() as stack:
        place = stack.enter_context(staged(vcd)) if vcd else None
        with Progress(1, "engine", f"preparing the simulation{FIRST_TIME}"):
            try:
                run, note = build_with_fallback(engine, lambda kind: ready_to_mill(
                    prepared.pixels, kind, period=period, vcd=place, guard=guard))
            except EngineError as error:
                raise UserError(str(error)) from error
        if note := note or why_slow(engine):
            warn(note)
        with run, Progress(prepared.count, "pixels", "milling") as progress:
            return run_job(run, prepared.pixels, period=period, progress=progress.advance)


def report(cut: Cut, rate: Fraction = TOP_SPEED) -> str:
    """Describe a cut in a few lines."""
    facts, plant = cut.facts(), cut.plant
    steps = plant.steps
    lines = [
        f"pixels     {facts['pixels_asked']} requested, {facts['pixels_cut']} cut, "
        f"{facts['pixels_missed']} missed, {facts['cut_in_error']} cut in error",
        f"steps      x {steps['axis_x']}, y {steps['axis_y']}, z {steps['axis_z']}; "
        f"{strokes(facts['strokes'])}",
        f"travel     {plant.milled.mm:.0f} mm milling, {plant.air.mm:.0f} mm "
        f"({plant.air.steps} steps) through the air",
        f"time       {duration(cut.job_seconds(rate))} on the machine, at "
        f"{float(rate):g} steps/s = {float(rate * RESOLUTION * 60):.3g} mm/min",
        f"simulated  {cut.clocks} clocks in {cut.seconds:.2g} s, "
        f"{facts['clocks_per_second']} clocks/s ({cut.engine})",
    ]
    if plant.faults:
        lines.append(f"coils      {len(plant.faults)} words that no motor can follow, "
                     f"first {plant.faults[0]}")
    if plant.position != (0, 0, 0):
        lines.append(f"tool       left at {plant.position} instead of the origin")
    return "\n".join(lines)


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.simulate", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--image", metavar="FILE", type=Path, default=EXAMPLE,
                        help="picture to mill (default: examples/strawberry.png)")
    parser.add_argument("--png", metavar="FILE", type=Path, default=Path("cut.png"),
                        help="picture of the cut (default: %(default)s)")
    parser.add_argument("--vcd", metavar="FILE", type=Path, help="write the waveform to a file")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to a file")
    parser.add_argument("--engine", metavar="NAME", choices=sorted(ENGINES),
                        help="see below (default: the fastest available)")
    parser.add_argument("--period", metavar="CLOCKS", type=_period, default=1,
                        help="clocks per step in the simulation (default: %(default)s)")
    parser.add_argument("--step-rate", metavar="HZ", type=step_rate, default=TOP_SPEED,
                        help="step rate of the real machine, for the time (default: 101.376)")
    add_picture_arguments(parser)
    args = parser.parse_args(argv)

    check_outputs(args.image, pictures=[args.png], others=[args.json, args.vcd])
    prepared = picture_from_arguments(args)
    cut = simulate(prepared, engine=args.engine, period=args.period, vcd=args.vcd)

    files = {args.png: encode(draw_cut(cut, args.step_rate))}
    if args.json is not None:
        facts = {"image": str(args.image), **cut.facts(),
                 "job_seconds": round(cut.job_seconds(args.step_rate), 3),
                 "step_rate": float(args.step_rate)}
        files[args.json] = (json.dumps(facts, indent=2) + "\n").encode()
    write_files_atomically(files)
    say(report(cut, args.step_rate))
    for path in (*files, *([args.vcd] if args.vcd else [])):
        say(f"wrote {path}")
    return 0 if cut.right else 1


def step_rate(text: str) -> Fraction:
    """Parse a step rate."""
    try:
        step_period(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return Fraction(text)


def _period(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and 1 <= int(text) <= 10_000):
        raise argparse.ArgumentTypeError(f"must be 1 to 10000 clocks, not {text!r}")
    return int(text)


if __name__ == "__main__":
    raise SystemExit(main())
