"""Lines of the hanging plotter against straight ones, by the lengths of its strings."""

import json
import os
from collections.abc import Callable, Sequence
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np

from tools.console import (
    Parser,
    Progress,
    check_outputs,
    command,
    say,
    warn,
    whole,
    write_files_atomically,
)
from tools.picture import encode
from tools.processes import pool

from .pages import with_figures
from .wall_path import Wall
from .wall_pictures import draw_lines, draw_map
from .wall_sums import BANDS, Motors, Sums, follow, measure, random_line, wall

__all__ = ["FIGURES", "PAGE", "broken", "figures", "main", "report"]

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
FIGURES, PAGE = DOCS / "vplotter-lines.json", DOCS / "vplotter.md"
MAP, COMPARED = DOCS / "vplotter-map.png", DOCS / "vplotter-bowed.png"

ABOUT = """\
Draws random lines with the hanging plotter, on models that are the gateware to the bit: from the
ends of a line, in um, to the ticks of X and Y, and from these to the lengths of both strings, in
whole steps. Where the pen is follows from the two lengths alone: it hangs below the pulleys in
gravity's triangle. How far it is from the line that was asked for, at most, is printed by how far
it is below the line of the pulleys; beside it

  motors      the same of some of the lines, of the steps that the motors make, which rest a period
              after each: at full speed and at F300
  geometry    how far it could be, if every coordinate and both strings were rounded at their worst
  bowed       how far it is in the lines of the thesis, where each string goes from its first length
              to its last at constant speed
  acceleration  of a string, from second differences of its true length

Exit status 1 if a pen is further off than 0.1 mm from 200 mm on, or further than geometry allows;
if a string is ever more than half a step off after a tick, goes faster than the path, or has more
acceleration than v²/d + a, v and a those of the path and d the distance to the pulley.

With --write the figures are kept in docs/vplotter-lines.json, the table in docs/vplotter.md and the
pictures beside it are drawn anew.
"""

EPILOG = """\
examples:
  python -m benchmarks.wall_lines
      Ten thousand lines: some three minutes on two cores.
  python -m benchmarks.wall_lines --lines 500 --picture map.png --compare bowed.png
"""

BOUND = {200: 0.1}
"""In mm, from there on."""

SLOW = 300.0
"""Mm/min: a motor that follows at this feed has time for each step that is requested."""

CHUNK = 20
"""Lines that a process does at once."""

TOLERANCE = 1.001
"""Of second differences, in real numbers."""


def figures(found: Sums, motors: dict[float | None, Motors], place: Wall, lines: int, seed: int
            ) -> dict[str, Any]:
    """Return what is worth keeping."""
    speed, acceleration = (hypot(*each[:2]) / 1e6 for each in (
        place.plan.speeds, place.plan.accelerations))
    motor = float(place.settings.string_steps)
    kept = {
        "lines": lines, "seed": seed, "ticks": found.ticks, "error": round(found.error, 6),
        "bands": [{
            "from": band, "straight": round(float(found.straight[number]), 4),
            "motors": [round(float(each.straight[number]), 4) for each in motors.values()],
            "geometry": _farthest(place, band),
            "bound": BOUND.get(band), "bowed": round(float(found.bowed[number]), 1),
            "acceleration": round(float(found.acceleration[number]), 1),
            "acceleration_bound": round(speed**2 / band + acceleration, 1),
        } for number, band in enumerate(BANDS)],
        "steps_per_mm": [place.steps_per_mm, motor],
        "geometry": {band: _farthest(Wall(place.settings, motor), band) for band in BOUND},
        "speed": round(found.speed, 6), "acceleration_share": round(found.share, 4),
        "steps": found.steps, "turned": found.turned, "near": found.near,
        "apart": round(found.apart), "period": place.settings.period,
        "motors": [{"feed": feed, "late": round(each.late), **{
            name: getattr(each, name) for name in ("steps", "made", "turned")}}
            for feed, each in motors.items()]}
    return {"good": not broken(kept), **kept}


def _farthest(place: Wall, band: float) -> float:
    """Return how far the pen can be from its place, from a y on, by rounding alone."""
    x = np.linspace(0, place.width, 500)[np.newaxis]
    y = np.linspace(band, place.height, 50)[:, np.newaxis]
    return round(float(place.farthest(x, y).max()), 4)


def broken(found: dict[str, Any]) -> list[str]:
    """Return what is out of its bounds."""
    bad = []
    for each in found["bands"]:
        bound = each["bound"] or np.inf
        bad += [f"from {each['from']} mm on the pen is {by:g} mm from a line, not {most:g} at most"
                for by, most in ((each["straight"], min(each["geometry"], bound)),
                                 *((by, bound) for by in each["motors"])) if by > most]
        if each["acceleration"] > each["acceleration_bound"] * TOLERANCE:
            bad.append(f"a string has an acceleration of {each['acceleration']:g} mm/s²")
    if found["error"] > 0.5:
        bad.append(f"a string is {found['error']:g} steps off")
    if found["speed"] > TOLERANCE:
        bad.append(f"a string goes {found['speed']:g} times as fast as the path")
    if found["acceleration_share"] > TOLERANCE:
        bad.append(f"a string has {found['acceleration_share']:g} times v²/d + a as acceleration")
    return bad


def report(found: dict[str, Any]) -> str:
    """Return the figures in Markdown."""
    lines = ["| y from | pen from the line | with motors | geometry | bound | bowed "
             "| string acceleration | v²/y + a |", "|" + " --- |" * 8]
    for each in found["bands"]:
        moved = ", ".join(f"{by:.3f}" for by in each["motors"])
        row = [f"{each['from']} mm", f"{each['straight']:.3f} mm", f"{moved} mm",
               f"{each['geometry']:.3f} mm", f"{each['bound']:g} mm" if each["bound"] else "",
               f"{each['bowed']:.0f} mm", f"{each['acceleration']:.0f} mm/s²",
               f"{each['acceleration_bound']:.0f} mm/s²"]
        lines.append(f"| {' | '.join(row)} |")
    steps, (made, motor) = found["steps"], found["steps_per_mm"]
    lines += [
        "", f"- {_many(found['lines'])} lines of {_many(found['ticks'])} ticks. After each tick "
        f"both strings are {found['error']:g} steps off at most.",
        f"- Motors that make {motor:.7g} steps per mm, not {made:.7g} as $100 says, can be "
        + ", ".join(f"{most:.3f} mm off from {band} mm on" for band, most in found[
            "geometry"].items()) + " by geometry.",
        f"- A string goes {found['speed']:.3f} times as fast as the path at most, and has "
        f"{found['acceleration_share']:.3f} of the acceleration v²/d + a.",
        f"- {_many(steps)} steps of strings are requested. {found['turned'] / steps:.0%} of them "
        f"take back the one before; {found['near'] / steps:.0%} come within a period of it, "
        f"{_many(found['period'])} clocks. In one direction they are {_many(found['apart'])} "
        "clocks apart at least."]
    for each in found["motors"]:
        how = "At full speed" if each["feed"] is None else f"At F{each['feed']:g}"
        lines.append(f"- {how} motors make {each['made'] / each['steps']:.1%} of them, and "
                     f"{each['turned'] / each['made']:.1%} of what they make goes back; a step "
                     f"waits for {_many(each['late'])} clocks at most.")
    return "\n".join(lines) + "\n"


def _many(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def _measured(seed: int, numbers: Sequence[int]) -> Sums:
    place = wall()
    return measure([random_line(f"{seed} {number}", place) for number in numbers], place)


def _followed(seed: int, number: int, feed: float | None) -> Motors:
    place = wall()
    return follow([random_line(f"{seed} {number}", place)], place, feed)


def run(lines: int, motors: int, seed: int, jobs: int, progress: Callable[[int], object]
        ) -> tuple[Sums, dict[float | None, Motors]]:
    """Draw random lines, and the first of them with motors, in so many processes."""
    total, moved = Sums.of(wall()), {}
    chunks = [range(begin, min(begin + CHUNK, lines)) for begin in range(0, lines, CHUNK)]
    with pool(jobs) as running:
        for chunk, each in zip(chunks, running.map(_measured, [seed] * len(chunks), chunks),
                               strict=True):
            total.add(each)
            progress(len(chunk))
        for feed in (None, SLOW):
            moved[feed] = sum_of = Motors()
            for each in running.map(_followed, [seed] * motors, range(motors), [feed] * motors):
                sum_of.add(each)
                progress(1)
    return total, moved


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.wall_lines", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--lines", type=whole(1, 10**7), default=10_000, metavar="N",
                        help="how many (default: %(default)s)")
    parser.add_argument("--motors", type=whole(1, 10**6), default=200, metavar="N",
                        help="those of which motors make the steps (default: %(default)s)")
    parser.add_argument("--jobs", type=whole(1, 1000), default=os.cpu_count(), metavar="N",
                        help="processes (default: %(default)s)")
    parser.add_argument("--seed", type=whole(0), default=1, metavar="N",
                        help="of the random numbers (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    parser.add_argument("--picture", metavar="FILE.png", type=Path,
                        help="draw a map of how far the pen is from its lines")
    parser.add_argument("--compare", metavar="FILE.png", type=Path,
                        help="draw some lines straight, and bowed as the thesis has them")
    parser.add_argument("--write", action="store_true",
                        help="keep the figures, and write the table and pictures of the page")
    args = parser.parse_args(argv)
    check_outputs(Path(), pictures=[args.picture, args.compare], others=[args.json])
    with Progress(args.lines + 2 * args.motors, "lines", "drawing") as progress:
        found, motors = run(args.lines, args.motors, args.seed, args.jobs, progress.advance)
    place = wall()
    facts = figures(found, motors, place, args.lines, args.seed)
    say(report(facts))
    bad = broken(facts)
    for each in bad:
        warn(each)
    made = {"json": lambda: (json.dumps(facts, indent=1) + "\n").encode(),
            "picture": lambda: encode(draw_map(found.chart, place, facts)),
            "compare": lambda: encode(draw_lines(place)),
            "page": lambda: with_figures(
                PAGE.read_text(encoding="utf-8"), "wall_lines", report(facts)).encode()}
    places = [(args.json, "json"), (args.picture, "picture"), (args.compare, "compare")]
    if args.write:
        places += [(FIGURES, "json"), (MAP, "picture"), (COMPARED, "compare"), (PAGE, "page")]
    write_files_atomically({path: made[what]() for path, what in places if path is not None})
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
