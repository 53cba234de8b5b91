"""Figures of the G-code machine beside those of GRBL, as a table in Markdown."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import cos, hypot, inf, pi, sin, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fresa.machines.gcode import GCode
from tb.boards import component
from tb.engines import CXXRTLEngine
from tb.models.gcode_blocks import Motion, ProgramModel
from tb.models.gcode_machine import MachineModel
from tb.models.gcode_plan import PlanSettings
from tb.models.walk import segment_steps
from tools.console import FIRST_TIME, Parser, Progress, command, say, write_files_atomically

from . import gcode, grbl, load, load_sender
from .load_sender import BYTE
from .pages import with_figures
from .step_instants import A4988, CLOCK

__all__ = ["FIGURES", "PAGE", "Row", "main", "table"]

ROOT = Path(__file__).parent.parent
FIGURES, PAGE = ROOT / "docs" / "gcode-beside-grbl.json", ROOT / "docs" / "gcode.md"

ABOUT = """\
Measures the G-code machine, at the pins of the gateware in simulation or on the model that is the
gateware to the clock, and prints its figures beside those of GRBL 1.1h, with where each is from.

There is no AVR here. Figures of GRBL are from its source and what its authors say there, or from
benchmarks/grbl.py: a small model of its published algorithm, which does the same programs with the
same settings, and for which lines are always there and calculations take no time.

With --write the figures are kept in docs/gcode-beside-grbl.json, and the table in docs/gcode.md is
written anew.
"""

SETTINGS = grbl.Machine(steps=80, speed=100, acceleration=500)
"""Of both: steps/mm, mm/s, mm/s²; $11 = 0.010, $12 = 0.002."""
SET = "".join(f"${number}={value:g}\n" for first, value in (
    (100, SETTINGS.steps), (110, 60 * SETTINGS.speed), (120, SETTINGS.acceleration))
    for number in range(first, first + 3)) + f"$11={SETTINGS.deviation}\n"
FEED = 50.0
"""Mm/s of the jobs."""
SECONDS = 2
"""Of the machine, for each part of `benchmarks.load`."""
CHORD, RADIUS, SMALL = 0.05, 10.0, 2.0
"""Mm."""
MODEL = "[model](../benchmarks/grbl.py)"
OURS = "[model](../tb/models/gcode_machine.py)"


@dataclass(frozen=True)
class Row:
    """A figure: what it is, of both machines, and where each is from."""

    figure: str
    ours: str
    ours_from: str
    grbl: str
    grbl_from: str


@dataclass(frozen=True)
class Move:
    """A line, or an arc around a centre, to a point in mm; an infinite feed is that of G0."""

    end: tuple[float, float]
    feed: float = FEED
    centre: tuple[float, float] | None = None
    clockwise: bool = False


def pocket() -> list[Move]:
    """Return lines of 30 mm, there and back again, a mm apart."""
    moves = []
    for number in range(12):
        x = 30.0 * (number % 2 == 0)
        moves += [Move((x, float(number))), Move((x, number + 1.0))]
    return [*moves, Move((0.0, 0.0), inf)]


def curve(chord: float = CHORD) -> list[Move]:
    """Return a closed curve with three lobes, in chords."""
    count = 1200
    angles = [2 * pi * number / count for number in range(count + 1)]
    size = chord * count / sum(hypot(*_apart(one, other)) for one, other in zip(
        angles, angles[1:], strict=False))
    return [Move((size * _lobes(angle)[0] - size * 1.2, size * _lobes(angle)[1]))
            for angle in angles[1:]]


def _lobes(angle: float) -> tuple[float, float]:
    radius = 1 + 0.2 * cos(3 * angle)
    return radius * cos(angle), radius * sin(angle)


def _apart(one: float, other: float) -> tuple[float, float]:
    (a, b), (c, d) = _lobes(one), _lobes(other)
    return a - c, b - d


def drawing() -> list[Move]:
    """Return half circles in a row, to both sides, and whole ones."""
    moves = [Move((4.0 * number + 4, 0.0), centre=(4.0 * number + 2, 0.0),
                  clockwise=number % 2 == 0) for number in range(10)]
    for radius in (10.0, 5.0, 1.0):
        moves.append(Move((40.0, 0.0), centre=(40.0 - radius, 0.0)))
    return [*moves, Move((0.0, 0.0), inf)]


JOBS: dict[str, Callable[[], list[Move]]] = {
    "lines of 30 mm": pocket, "a curve in chords of 0.05 mm": curve, "a drawing of arcs": drawing}


def text(moves: Sequence[Move]) -> list[str]:
    """Return moves as G-code, in mm, absolute."""
    lines, at = [], (0.0, 0.0)
    for move in moves:
        words = f"X{move.end[0]:.3f}Y{move.end[1]:.3f}"
        if move.centre is not None:
            words = (f"G{3 - move.clockwise}{words}I{move.centre[0] - at[0]:.3f}"
                     f"J{move.centre[1] - at[1]:.3f}F{60 * move.feed:g}")
        elif move.feed == inf:
            words = f"G0{words}"
        else:
            words = f"G1{words}F{60 * move.feed:g}"
        lines.append(words)
        at = move.end
    return lines


def path(moves: Sequence[Move]) -> list[tuple[tuple[float, float], float]]:
    """Return moves as GRBL has them: lines to points, arcs in chords."""
    points, at = [], (0.0, 0.0)
    for move in moves:
        end = round(move.end[0], 3), round(move.end[1], 3)
        ends = [end] if move.centre is None else grbl.chords(
            at, end, move.centre, move.clockwise, SETTINGS.tolerance)
        points += [(point, move.feed) for point in ends]
        at = end
    return points


def plan_settings(machine: grbl.Machine) -> PlanSettings:
    """Return the same settings for the model of the gateware, at 50 MHz."""
    return PlanSettings(
        clock=CLOCK, speeds=(round(machine.speed * 1e6),) * 3,
        accelerations=(round(machine.acceleration * 1e6),) * 3,
        steps=(round(machine.steps * 1000),) * 3, deviation=round(machine.deviation * 1e6))


def motions(machine: grbl.Machine, lines: Sequence[str]) -> list[Motion]:
    """Return the blocks of lines on the model of the gateware."""
    model, found = ProgramModel(plan_settings(machine)), []
    for line in lines:
        answer, made = model.line(line)
        if answer != "ok":
            raise RuntimeError(f"{line} is answered {answer}")
        found += [block for block in made if isinstance(block, Motion)]
    return found


def jobs() -> Iterator[Row]:
    """Do the jobs at the pins of the gateware, at 1 Mbaud, and on the model of GRBL."""
    settings = load_sender.SETTINGS
    with CXXRTLEngine(component("gcode", GCode(settings=settings))) as engine:
        machine = load_sender.Machine(engine)
        for line in SET.splitlines(keepends=True):
            machine.send(line.encode())
            machine.wait(100 * BYTE)
        for name, make in JOBS.items():
            moves = make()
            before = len(machine.answers)
            begin = engine.clock
            for number, line in enumerate(text(moves)):
                while len(machine.answers) - before < number - 3:
                    machine.wait(BYTE)
                machine.send(f"{line}\n".encode())
            machine.rest(60)
            refused = [each for each in machine.answers if each != b"ok"]
            if refused or machine.position.any():
                raise RuntimeError(f"{name}: {refused[:1]}, ends at {machine.position.tolist()}")
            ours = (machine.last - begin) / settings.clock
            theirs = grbl.duration(grbl.blocks(SETTINGS, path(moves)))
            yield Row(f"time of a job: {name}", f"{ours:.2f} s", "pins of the gateware",
                      f"{theirs:.2f} s", MODEL)


def corner() -> Row:
    """Compare the slowest corner of a circle in chords."""
    fast = grbl.Machine(SETTINGS.steps, 300, SETTINGS.acceleration)
    count = round(2 * pi * RADIUS / CHORD)
    moves = [Move((RADIUS * cos(2 * pi * number / count) - RADIUS,
                   RADIUS * sin(2 * pi * number / count)), 300) for number in range(1, count + 1)]
    ours = [sqrt(block.limit) * 60 / 1e6 for block in motions(fast, text(moves))[1:]]
    theirs = [sqrt(block.junction) * 60 for block in grbl.blocks(fast, path(moves))[1:]]
    return Row(f"slowest corner of a circle of {RADIUS:g} mm in chords of {CHORD:g} mm",
               f"{_many(min(ours))} mm/min", OURS, f"{_many(min(theirs))} mm/min", MODEL)


def arc() -> Row:
    """Compare the farthest of all places on a circle from it."""
    line = Move((0.0, 0.0), 10, (-RADIUS, 0.0))
    block, = motions(SETTINGS, text([line]))
    made = segment_steps(block.segment, block.fine, block.coarse)
    events = sorted((tick, axis, way) for axis in range(2)
                    for tick, way in made[block.segment.channel[axis]])
    change = np.zeros((len(events), 2), np.int64)
    for row, (_, axis, way) in enumerate(events):
        change[row, axis] = way
    ours = _off(change.cumsum(axis=0))
    theirs = _off(grbl.walked(grbl.blocks(SETTINGS, path([line]))))
    return Row(f"farthest place from a circle of {RADIUS:g} mm, {SETTINGS.steps:g} steps/mm",
               f"{ours:.2f} steps", OURS, f"{theirs:.2f} steps", MODEL)


def _off(places: NDArray[np.int64]) -> float:
    """Return how far places are from the circle at most, in steps."""
    radius = RADIUS * SETTINGS.steps
    return float(np.abs(np.hypot(places[:, 0] + radius, places[:, 1]) - radius).max())


def sideways() -> Row:
    """Compare the acceleration towards the centre of a small arc."""
    line = Move((0.0, 0.0), FEED, (-SMALL, 0.0))
    block, = motions(SETTINGS, text([line]))
    made = grbl.blocks(SETTINGS, path([line]))
    theirs = max(min(block.junction, block.nominal**2) for block in made[1:])
    return Row(f"acceleration towards the centre of an arc of {SMALL:g} mm, F{60 * FEED:g}, "
               f"{SETTINGS.acceleration:g} mm/s² set",
               f"{block.profile.nominal / 1e12 / SMALL:.0f} mm/s²", OURS,
               f"{_many(theirs / SMALL)} mm/s²", MODEL)


def jitter() -> Iterator[Row]:
    """Compare intervals of the slower of two axes at constant speed."""
    stiff = grbl.Machine(SETTINGS.steps, 200, 5000)
    for rate in (10_000, 1500):
        x, slope = 20.0 if rate > 5000 else 5.0, 0.618
        feed = rate / stiff.steps * hypot(1, slope)
        model = MachineModel(plan_settings(stiff), A4988)
        model.send(f"G1X{x:g}Y{x * slope:g}F{60 * feed:.3f}\n".encode())
        ours = np.array([clock for clock, _ in model.steps()[1]]) / CLOCK
        theirs = grbl.step_instants(grbl.blocks(stiff, [((x, x * slope), feed)])[0])[1]
        yield Row("step jitter: intervals of the slower of two axes differ, the other at "
                  f"{_many(rate)} steps/s", f"{_spread(ours):.2f} us", OURS,
                  f"{_spread(theirs):.1f} us", MODEL)


def _spread(instants: NDArray[np.float64]) -> float:
    """Return by how many us intervals differ in the middle third."""
    apart = np.diff(instants)[len(instants) // 3:2 * len(instants) // 3]
    return 1e6 * float(np.ptp(apart))


def _many(number: float) -> str:
    return f"{number:,.0f}".replace(",", " ")


def rows(progress: Callable[[], object] = lambda: None) -> Iterator[Row]:
    """Yield the table."""
    loaded = {each.name: each for each in load.figures(SECONDS)}
    progress()
    for name, of in (("of some 24 bytes", "streaming"), ("of some 17 bytes",
                                                          "streaming, short lines")):
        lines = loaded[f"{of}: lines answered"].measured
        share = loaded[f"{of}: line used"].measured / 100
        most = lines / share * grbl.BAUD / load_sender.SETTINGS.line_baud
        yield Row(f"lines a second, {name}", f"{_many(lines)}, at 1 Mbaud and 16 MHz",
                  "`benchmarks.load`", f"at most {_many(most)}, at {_many(grbl.BAUD)} baud",
                  "its line: config.h")
    yield Row(f"steps a second, of each of three axes, at {gcode.PER_MM} steps/mm",
              f"at least {_many(gcode.RATE)}", "`benchmarks.gcode`, which fails below that",
              _many(grbl.STEPS_PER_S), "README.md, stepper.c")
    yield from jitter()
    yield Row("speed changes in a ramp every", f"{gcode.GRANULE / CLOCK * 1e6:.2f} us, or a tick",
              "[profile](../hdl/fresa/motion/profile.py)", f"{_many(grbl.SEGMENT_S * 1e6)} us",
              "config.h")
    yield corner()
    yield arc()
    yield sideways()
    yield from jobs()
    allowed = load.ALLOWED / load_sender.SETTINGS.clock
    yield Row("hold: brakes after", f"at most {allowed * 1e6:.0f} us, with its byte, at 16 MHz",
              "`benchmarks.load`, which fails above that",
              f"40 000 to {_many(grbl.HOLD_S * 1e6)} us", "stepper.c")


def table(found: Sequence[dict[str, str]]) -> str:
    """Return rows as a table in Markdown."""
    lines = ["| | `gcode` | from | GRBL 1.1h | from |", "| --- | --- | --- | --- | --- |"]
    lines += ["| " + " | ".join(row.values()) + " |" for row in found]
    return "\n".join(lines) + "\n"


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.beside_grbl", description=ABOUT)
    parser.add_argument("--write", action="store_true",
                        help="keep the figures, and write the table of the page")
    args = parser.parse_args(argv)
    with Progress(1, "parts", f"measuring{FIRST_TIME}") as progress:
        found = [asdict(row) for row in rows(progress.advance)]
    say(table(found))
    if args.write:
        write_files_atomically({
            FIGURES: (json.dumps(found, indent=1, ensure_ascii=False) + "\n").encode(),
            PAGE: with_figures(PAGE.read_text(), "beside_grbl", table(found)).encode()})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
