"""Run a program of G-code on the gateware, and draw what its pins did."""

import argparse
import json
import re
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from fresa.machines.gcode import AXES, GCodeSettings
from fresa_host.errors import MachineError
from fresa_host.gcode_lines import ERRORS, BlockRefused, program
from tb.engines import Engine, EngineError, build_with_fallback, why_slow
from tb.machines.gcode import MACHINE
from tb.models.gcode_language import RefusedLine

from ..console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    check_outputs,
    command,
    say,
    staged,
    warn,
    whole,
    write_files_atomically,
)
from ..cut_picture import duration
from ..machines.options import add_options, values_of
from ..picture import encode
from .job import Job, asked_steps, run
from .path import Asked
from .picture import draw_job
from .simulation import Pins, Simulation

__all__ = ["main", "report"]

ABOUT = """\
Sends a program of G-code to the gateware of a G-code machine in simulation, over its serial line,
and counts the steps at its pins until it stands. Prints how long the job takes on the real machine,
how fast it goes, and how far the pins were from the path that was asked for, by a model of the
language. A program that pauses (M0) is started again at once.

A line that the machine refuses is shown; then nothing is written, and the exit status is 1. So it
is if the pins left the path by more than rounding does, or did not follow it to its end, or if the
two motors of --second-motor did not make each step together.
"""

EPILOG = """\
The clock of the simulation is lower than a board's, since each clock takes time. Speeds are the
same; a step comes a few clocks earlier or later. Only very short lines, one after the other, may
wait for their planning, unlike on a board: each takes some 3000 clocks.

examples:
  python -m tools.gcode examples/flower.ngc --steps 80 80 400 --rate 6000 6000 1200 \\
      --acceleration 500 500 100 --png flower.png
      Run it, and draw its path coloured by speed, and speed and acceleration over time.

  python -m tools.gcode part.ngc --json part.json
      Write the figures to a file.

  python -m tools.gcode part.ngc --vcd part.vcd
      Write the waveform of the pins, for python -m tools.wave.

  generate | python -m tools.gcode - --clock 50000000
      A program from another one, at the clock of a board: that takes twenty times as long.

engines:
  cxxrtl     the gateware as C++; needs a C++ compiler; half a million clocks a second or more
  amaranth   Amaranth's own simulator; always available; two thousand clocks a second
"""

CLOCKS = (2_500_000, 5_000_000, 10_000_000, 20_000_000, 50_000_000)
"""In Hz. The first is used at which the machine can be built."""

LARGEST = 1 << 26
"""Bytes of the longest program that is read."""

CHANGE_BYTES = 17
"""Bytes of a change in a waveform."""

NOT_TEXT = re.compile(rb"[\0-\x08\x0e-\x19\x1b-\x1f]")


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.gcode", description=ABOUT, epilog=EPILOG)
    parser.add_argument("file", metavar="FILE", type=Path, help="program; - for standard input")
    parser.add_argument("--png", metavar="FILE", type=Path, help="draw the job")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to a file")
    parser.add_argument("--vcd", metavar="FILE", type=Path,
                        help="write the waveform of the pins to a file")
    parser.add_argument("--clock", metavar="HZ", type=whole(2_000_000, 100_000_000),
                        help="clock of the simulation (default: 2500000, or higher where the "
                             "steps or the serial line need it)")
    parser.add_argument("--engine", metavar="NAME", choices=["cxxrtl", "amaranth"],
                        help="see below (default: the fastest available)")
    # It runs a program of GRBL's dialect that comes on the line, and nothing else; pins are those
    # of axes.
    add_options(parser.add_argument_group("machine"), (
        option for option in MACHINE.options
        if option.name not in ("dialect", "program", "kinematics", "startup")))
    args = parser.parse_args(argv)

    check_outputs(args.file, pictures=[args.png], others=[args.json, args.vcd])
    name = "standard input" if str(args.file) == "-" else str(args.file)
    settings = _settings(args.clock, values_of(args, MACHINE.options))
    try:
        blocks = program(_read(args.file, name))
    except ValueError as error:
        say(f"{name}, {error}")
        return 1
    if not blocks:
        raise UserError(f"there is no line of G-code in {name}")
    asked, refused = _ask(blocks, settings)
    try:
        job, engine = _simulate(blocks, asked, settings, args)
    except BlockRefused as error:
        say(_refusal(name, error.line or 0, error.text, error.code))
        return 1
    except MachineError as error:
        say(f"{name}: {error}")
        return 1
    if refused is not None:
        raise RuntimeError("the machine took what the model refuses: " + _refusal(name, *refused))
    return _write(job, name, args, engine)


def _simulate(blocks: Sequence[tuple[int, str]], asked: Asked, settings: GCodeSettings,
              args: argparse.Namespace) -> tuple[Job, str]:
    """Run a program; return the job, and the engine with its clocks."""
    steps = asked_steps(asked.segments, settings)
    with ExitStack() as stack:
        engine = stack.enter_context(_build(settings, args.engine))
        pins = None
        if args.vcd is not None:
            size = CHANGE_BYTES * (2 * steps + 9 * sum(len(text) + 5 for _, text in blocks))
            warn(f"{args.vcd} will have some {size / 1e6:.2g} MB")
            pins = Pins(stack.enter_context(staged(args.vcd)), settings)
            stack.callback(lambda: pins.close(engine.clock))
        with Progress(max(1, steps), "steps", "running") as progress:
            left = [max(1, steps)]

            def advance(made: int) -> None:
                made = min(made, left[0])  # of arcs the number is not known so well
                left[0] -= made
                progress.advance(made)

            simulation = Simulation(engine, settings, pins)
            job = run(simulation, blocks, asked.segments, settings, advance)
        return job, engine.name


def _write(job: Job, name: str, args: argparse.Namespace, engine: str) -> int:
    """Analyse a job, write files, and print the report."""
    with Progress(len(job.steps.clock), "steps", "comparing") as progress:
        deviation = job.deviation(progress.advance)
    motion = job.motion()
    facts = {"program": name, "engine": engine, **job.facts(motion, deviation)}
    lines = report(facts)
    files = {}
    if args.png is not None:
        with Progress(1, "pictures", "drawing"):
            files[args.png] = encode(draw_job(job, motion, Path(name).name, lines))
    if args.json is not None:
        files[args.json] = (json.dumps(facts, indent=2) + "\n").encode()
    write_files_atomically(files)
    for line in lines:
        say(line)
    for path in (*files, *([args.vcd] if args.vcd else [])):
        say(f"wrote {path}")
    return 0 if facts["right"] else 1


def report(facts: dict[str, Any]) -> list[str]:
    """Describe a job in a few lines, of its facts."""
    steps = ", ".join(f"{axis} {made}" for axis, made in facts["steps"].items())
    end = " ".join(f"{axis}{at:g}" for axis, at in zip("XYZ", facts["end_mm"], strict=True))
    paused = f", started again {_count(facts['pauses'], 'time')}" if facts["pauses"] else ""
    return [
        f"{_count(facts['lines'], 'line')} of G-code, a path of {facts['asked_mm']:.1f} mm in "
        f"{_count(facts['segments'], 'part')}",
        f"{duration(facts['seconds'])} on the machine{paused}; "
        f"up to {facts['top_speed_mm_min']:.0f} mm/min",
        f"steps: {steps}; ends at {end}",
        f"{'' if facts['right'] else 'WRONG: '}at most {facts['deviation_mm']:.4f} mm, "
        f"{facts['deviation_steps']:.2f} steps, off the path; "
        f"{facts['followed_mm']:.1f} mm of it followed",
        *_second(facts),
        f"simulated at {facts['clock'] / 1e6:g} MHz ({facts['engine']})",
    ]


def _second(facts: dict[str, Any]) -> list[str]:
    """Describe what a second motor has done, if there is one."""
    if not (axis := facts.get("second_motor")):
        return []
    if apart := facts["steps_apart"]:
        return [f"WRONG: the two motors of {axis} made {_count(apart, 'step')} apart"]
    return [f"the two motors of {axis} made all steps together"]


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _read(path: Path, name: str) -> list[str]:
    """Read the lines of a program."""
    if str(path) == "-":
        if sys.stdin is None:
            raise UserError("there is no standard input to read: give a file")
        data = sys.stdin.buffer.read(LARGEST + 1)
    else:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise UserError(f"{name} is longer than {LARGEST >> 20} MB: cut it into parts")
    if NOT_TEXT.search(data):
        raise UserError(f"{name} is no program: it is not text")
    return re.split(r"\r\n|\r|\n", data.removesuffix(b"\x1a").decode(errors="replace"))


def _settings(clock: int | None, values: dict[str, Any]) -> GCodeSettings:
    """Return the machine at a clock, or at the lowest at which it can be built."""
    reason = ""
    for hertz in CLOCKS if clock is None else (clock,):
        try:
            settings: GCodeSettings = MACHINE.real(hertz, **values)["settings"]
            _ = settings.bit  # raises it too
            break
        except ValueError as error:
            reason = str(error)
    else:
        raise UserError(f"a machine with these options cannot be simulated: {reason}")
    if any(settings.store.get(220 + axis) for axis in range(AXES)):
        raise UserError("steps that take up backlash are not of the path: leave $220 to $222 out")
    return settings


def _ask(blocks: Sequence[tuple[int, str]], settings: GCodeSettings
         ) -> tuple[Asked, tuple[int, str, int] | None]:
    """Return the path of a program, and the line that the model refuses, with the error's code."""
    asked = Asked([settings.store[100 + axis] for axis in range(AXES)])
    with Progress(len(blocks), "lines", "reading") as progress:
        for number, text in blocks:
            try:
                asked.add(text)
            except RefusedLine as error:
                return asked, (number, text, error.args[0])
            except ValueError as error:
                raise UserError(f"line {number}: {error}") from error
            progress.advance()
    return asked, None


def _refusal(name: str, number: int, text: str, code: int) -> str:
    meaning = ERRORS.get(code, "the machine does not say why")
    return f"{name}, line {number}: {meaning} (error:{code})\n    {text}"


def _build(settings: GCodeSettings, name: str | None) -> Engine:
    """Build the machine at power-up."""
    def make(kind: type[Engine]) -> Engine:
        engine = kind(MACHINE.design(settings=settings))
        assert MACHINE.serve is not None
        engine.set(**MACHINE.serve.levels)
        return engine

    with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
        try:
            engine, note = build_with_fallback(name, make)
        except EngineError as error:
            raise UserError(str(error)) from error
    if note := note or why_slow(name):
        warn(note)
    return engine


if __name__ == "__main__":
    raise SystemExit(main())
