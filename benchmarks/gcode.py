"""What the G-code machine reaches, measured at its pins."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from amaranth import Module, Signal, Value
from numpy.typing import NDArray

from fresa.machines.gcode import AXES, GCode, GCodeSettings
from fresa.motion import GCodeControl, GCodePlanner
from fresa.protocol import RealtimeFilter
from tb.boards import component
from tb.design import Design
from tb.engines import CXXRTLEngine
from tb.models.protocol import bits
from tb.uart import Decoder
from tools.console import (
    Parser,
    Progress,
    check_output,
    command,
    say,
    whole,
    write_atomically,
)

__all__ = ["Figure", "figures", "main", "report"]

CLOCK = 50_000_000

PER_MM = 400
"""Steps per mm: with three axes the path is then nearly as fast as can be, 2.1 m/s."""

FINE, COARSE = 8000, 1600
"""Steps per mm with short pulses, of three axes and of one."""

SHORT_NS = 100
"""Of a short pulse, and from one to the next."""

PATH = 2.147
"""m/s: 2**31 - 1 nm/s."""

ARC_PER_MM, RADIUS, ARC_FEED = 250, 400, 110_000
"""Of an arc: steps per mm, radius in mm, and mm/min."""

ABOUT = f"""\
Runs the G-code machine at 50 MHz in simulation, clock by clock, with the times of an A4988 and
{PER_MM} steps/mm, and measures at its pins: how many steps a second each of three axes makes in
lines of all three at once, how many short lines a second are read, planned and made at 1 Mbaud,
that each is answered and all end where they say, in how many clocks a limit switch stops, and on
how much way a feed hold. Then, with {ARC_PER_MM} steps/mm, half a circle as fast: what two axes
reach where it runs along them, how far the pins are from the circle, and how constant the feed is.

Then the same machine with drivers that take pulses of {SHORT_NS} ns: how many steps a second each
of three axes makes in lines of all three at once, with {FINE} steps/mm, and how many one axis
makes by itself, with {COARSE} steps/mm. With so few, the path of three axes as fast as that would
be faster than the {PATH:g} m/s that a path may have. In all, three minutes.

Exit status 1 if one is not as asked.
"""

EPILOG = """\
examples:
  python -m benchmarks.gcode
  python -m benchmarks.gcode --blocks 100000 --json gcode.json
      End positions after a hundred thousand blocks: half an hour.

see also: benchmarks.planning for the depth of look-ahead, benchmarks.step_times for the instants of
steps, benchmarks.arcs for circles, benchmarks.size for cells and clocks.
"""

RATE = 450_000
"""Steps/s of each axis that are asked for."""
SHORT_RATE = 3_000_000
"""The same with short pulses."""
LINES = 5_000
"""Lines a second that are asked for."""
STOP = 4
"""Clocks from the end of the filter's time to the last rising edge at most."""
OFF_CIRCLE = 1
"""Steps from the true circle at most."""
FEED = 0.01
"""By what share the feed of an arc differs at most."""
GRANULE = 128
"""Clocks in which the speed changes at least once."""

FAST = GCodeSettings(
    baud=1_000_000, steps_per_mm=(Fraction(PER_MM),) * AXES,
    max_rate=(Fraction(67_700),) * AXES, acceleration=(Fraction(17_000),) * AXES)

SHORT = replace(
    FAST, steps_per_mm=(Fraction(FINE),) * AXES, max_rate=(Fraction(22_560),) * AXES,
    width_ns=SHORT_NS, low_ns=SHORT_NS, setup_ns=20, hold_ns=20)

ARC = b"$100=%d\n$101=%d\n$110=%d\n$111=%d\n" % (*(ARC_PER_MM,) * 2, *(ARC_FEED,) * 2)
"""Sets X and Y of it, in an order in which each is one that pulses can make."""

ALONE = b"$110=100\n$100=%d\n$110=112800\n" % COARSE
"""Sets X of it, which makes steps by itself; a rate must be one that pulses can make."""


class Figure(NamedTuple):
    """A figure.

    Attributes
    ----------
    name, unit : str
        What it is.
    measured, least, most : float, optional
        What came out, and the range that is asked for.
    """

    name: str
    unit: str
    measured: float
    least: float | None = None
    most: float | None = None

    @property
    def right(self) -> bool:
        """Whether it is as asked."""
        return ((self.least is None or self.measured >= self.least)
                and (self.most is None or self.measured <= self.most))

    def __str__(self) -> str:
        asked = (f"asked: at least {self.least:,.10g}" if self.least is not None
                 else f"asked: at most {self.most:,.10g}" if self.most is not None else "")
        return (f"{self.name:68} {self.measured:>12,.10g} {self.unit:9} {asked:25}"
                f"{'' if self.right else '  NOT REACHED'}").rstrip()


class Watched(GCode):
    """The machine; `passed` shows which limit switches its filter has passed."""

    def __init__(self, *, settings: GCodeSettings) -> None:
        super().__init__(settings=settings)
        self.passed = Signal(AXES)

    def _inputs(self, m: Module, control: GCodeControl, realtime: RealtimeFilter,
                planner: GCodePlanner, flags: Value) -> Signal:
        switches = super()._inputs(m, control, realtime, planner, flags)
        m.d.comb += self.passed.eq(control.limits)
        return switches

    @classmethod
    def design(cls, settings: GCodeSettings) -> Design:
        """Return it as a design, with that as an output."""
        machine = cls(settings=settings)
        design = component("gcode", machine)
        return replace(design, outputs={**design.outputs, "passed": machine.passed})


class Machine:
    """The machine on an engine, and the steps that left its pins."""

    def __init__(self, engine: CXXRTLEngine, settings: GCodeSettings = FAST) -> None:
        self.engine = engine
        self.bit = settings.bit
        self.decoder = Decoder(self.bit)
        self.position = np.zeros(AXES, np.int64)
        self.high = 0
        self.edges: list[list[NDArray[np.int64]]]
        self.ways: list[list[NDArray[np.int64]]]
        self.forget()
        engine.set(rx=1)
        self.run(5_000)

    def run(self, clocks: int) -> None:
        """Let time pass, and count; note when the first limit switch was passed."""
        seen = self.engine.run(clocks, ("step", "direction", "tx", "passed"))
        passed = np.flatnonzero(seen["passed"])
        if self.passed < 0 and len(passed):
            self.passed = int(seen.clock[passed[0]])
        step = seen["step"].astype(np.int64)
        rises = step & ~np.concatenate([[self.high], step[:-1]]) if len(step) else step
        self.high = int(step[-1]) if len(step) else self.high
        clock, direction = seen.clock.astype(np.int64), seen["direction"].astype(np.int64)
        for axis in range(AXES):
            rows = np.flatnonzero(rises >> axis & 1)
            if len(rows):
                self.edges[axis].append(clock[rows])
                self.ways[axis].append(2 * (direction[rows] >> axis & 1) - 1)
                self.position[axis] += int(self.ways[axis][-1].sum())
        for when, level in zip(seen.clock.tolist(), seen["tx"].tolist(), strict=True):
            self.text += self.decoder.feed(when, level).decode()

    def send(self, data: bytes) -> None:
        """Send bytes, one after the other."""
        for byte in data:
            for level in bits(byte):
                self.engine.set(rx=level)
                self.run(self.bit)

    def finish(self) -> None:
        """Wait until nothing moves."""
        self.run(20_000)
        while self.engine.get("moving"):
            self.run(20_000)
        self.run(20_000)

    def steps(self, axis: int) -> NDArray[np.int64]:
        """Return the clocks of the rising edges of an axis so far."""
        return np.concatenate([np.zeros(0, np.int64), *self.edges[axis]])

    def places(self, axis: int, clocks: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return where an axis is in some clocks, by the edges so far."""
        ways = np.concatenate([np.zeros(1, np.int64), *self.ways[axis]])
        return np.cumsum(ways)[np.searchsorted(self.steps(axis), clocks, "right")]

    def forget(self) -> None:
        """Forget edges, text and switches; places are then counted from here."""
        self.edges, self.ways = ([[] for _ in range(AXES)] for _ in range(2))
        self.text, self.passed = "", -1


def _rate(machine: Machine, drivers: str, names: str, lines: int, mm: int, per_mm: int, least: int
          ) -> Iterator[Figure]:
    """Measure axes at once, at the highest speed, over 1000 steps in the middle of equal lines."""
    begin = machine.position.copy()
    machine.forget()
    machine.send(b"G91\n" + lines * f"G0{''.join(f'{name}{mm}' for name in names)}\n".encode())
    machine.finish()
    slowest = min(1000 * CLOCK / (steps[len(steps) // 2 + 500] - steps[len(steps) // 2 - 500])
                  for steps in map(machine.steps, range(len(names))))
    of = (f"{'each of three axes at once' if len(names) > 1 else 'one axis by itself'}, "
          f"{drivers}, {per_mm} steps/mm")
    yield Figure(of, "steps/s", round(float(slowest)), least)
    wanted = np.array([lines * mm * per_mm] * len(names) + [0] * (AXES - len(names)))
    yield Figure(f"missing, {of}", "steps",
                 int(abs(machine.position - begin - wanted).sum()), most=0)


def _lines(machine: Machine, count: int) -> Iterator[Figure]:
    """Stream short lines with no pause; the path goes on and on, at a corner now and then."""
    machine.send(b"G90G1F15000\n")  # 8800 of these lines a second
    machine.finish()
    machine.forget()
    at = machine.position.copy()
    rng = np.random.default_rng(1)
    way = np.array([1, 1, 0])
    begin, lines = machine.engine.clock, 0
    for number in range(count):
        if number % 200 == 199:
            way = rng.permutation(np.array([1, 1, 0])) * rng.choice([-1, 1])
        at = at + 8 * way
        # Wait for answers, as a sender would that counts bytes.
        while lines - machine.text.count("\n") > 8:
            machine.run(machine.bit)
        machine.send(b"".join(b"%c%.2f" % (b"XYZ"[axis], at[axis] / PER_MM)
                              for axis in np.flatnonzero(way)) + b"\n")
        lines += 1
    while machine.text.count("\n") < lines:
        machine.run(machine.bit)
    seconds = (machine.engine.clock - begin) / CLOCK
    machine.finish()
    yield Figure("short lines read, planned and answered", "lines/s", round(lines / seconds), LINES)
    yield Figure("lines not answered ok", "lines", lines - machine.text.count("ok\r\n"), most=0)
    yield Figure(f"steps off the end of {lines:,} blocks", "steps",
                 int(abs(machine.position - at).sum()), most=0)


def _hold(machine: Machine) -> Iterator[Figure]:
    """Hold a line at 100 mm/s, and let it go on."""
    speed, acceleration = 100.0, float(FAST.acceleration[0])
    begin = int(machine.position[0])
    machine.send(b"G91G1X20F6000\n")
    machine.run(2_000_000)
    machine.forget()
    machine.send(b"!")
    sent = machine.engine.clock - machine.bit // 2  # the middle of the stop bit
    machine.run(2_000_000)
    edges = machine.steps(0)
    way = float((edges > sent).sum()) / PER_MM
    machine.send(b"~")
    machine.finish()
    ideal = speed**2 / 2 / acceleration
    granule = 2 * GRANULE * speed / CLOCK
    yield Figure("way of a hold beyond v²/2a", "mm", round(way - ideal, 4),
                 most=round(granule + 2 / PER_MM, 4))
    yield Figure("steps off the end after a hold", "steps",
                 abs(int(machine.position[0]) - begin - 20 * PER_MM), most=0)


def _arc(machine: Machine) -> Iterator[Figure]:
    """Make half a circle that begins between the axes, and runs along one and then the other."""
    machine.send(ARC)
    machine.forget()
    begin = machine.position.copy()
    side = round(RADIUS / 2**0.5, 2)  # so that it ends at a step
    machine.send(b"G91G17G3X-%.3fY-%.3fI-%.3fJ-%.3fF%d\n"
                 % (2 * side, 2 * side, side, side, ARC_FEED))
    machine.finish()
    of = f"an arc of {RADIUS} mm, A4988, {ARC_PER_MM} steps/mm"
    fastest = min(1000 * CLOCK / (steps[1000:] - steps[:-1000]).min()
                  for steps in map(machine.steps, range(2)))
    yield Figure(f"each of two axes where it is fastest, {of}", "steps/s", round(float(fastest)),
                 RATE)
    ends = np.array([-round(2 * side * ARC_PER_MM)] * 2 + [0])
    yield Figure(f"missing, {of}", "steps", int(abs(machine.position - begin - ends).sum()), most=0)
    clocks = np.union1d(machine.steps(0), machine.steps(1))
    x, y = (machine.places(axis, clocks) + side * ARC_PER_MM for axis in range(2))
    radius = side * 2**0.5 * ARC_PER_MM
    yield Figure(f"farthest from the circle, {of}", "steps",
                 round(float(abs(np.hypot(x, y) - radius).max()), 2), most=OFF_CIRCLE)
    angle = np.unwrap(np.arctan2(y, x))
    # Long after it speeds up, and before it brakes
    first, last = clocks[np.searchsorted(angle, [np.pi / 2, np.pi])].tolist()
    window = CLOCK // 200
    times = np.arange(first, last, window)
    feeds = np.diff(np.interp(times, clocks, angle)) * radius * CLOCK / window
    wanted = ARC_FEED / 60 * ARC_PER_MM
    yield Figure("change of feed along it, in 5 ms", "of it",
                 round(float(abs(feeds / wanted - 1).max()), 5), most=FEED)


def _stop(machine: Machine, count: int) -> Iterator[Figure]:
    """Close a limit switch while three axes run, at any time between two ticks of its filter."""
    longest = FAST.filter * 3 // 2 + 6  # of a ContactFilter
    filtered, latest = [], []
    for number in range(count):
        machine.send(b"G91G1X-40Y-38Z-36F60000\n")
        machine.run(1_500_000 + 37 * number)
        machine.forget()
        machine.engine.set(limits=1 << number % AXES)
        closed = machine.engine.clock
        machine.run(50_000)
        filtered.append(machine.passed - closed)
        last = max((int(steps[-1]) for steps in map(machine.steps, range(AXES)) if len(steps)),
                   default=closed)
        latest.append(last - machine.passed)
        machine.engine.set(limits=0)
        machine.send(b"\x18$X\n")
        machine.run(100_000)
    yield Figure("longest time for which a limit switch was filtered", "clocks", max(filtered),
                 most=longest)
    yield Figure("last edge after a limit switch and the time of its filter", "clocks",
                 max(latest), most=STOP)


def figures(blocks: int, stops: int) -> Iterator[Figure]:
    """Yield the figures, with so many blocks streamed, and stops by a limit switch."""
    with CXXRTLEngine(Watched.design(FAST)) as engine:
        machine = Machine(engine)
        yield from _rate(machine, "A4988", "XYZ", 5, 40, PER_MM, RATE)
        yield from _lines(machine, blocks)
        yield from _hold(machine)
        yield from _stop(machine, stops)
        yield from _arc(machine)
        yield Figure("faults", "", engine.get("fault"), most=0)
    with CXXRTLEngine(Watched.design(SHORT)) as engine:
        machine, short = Machine(engine, SHORT), f"pulses of {SHORT_NS} ns"
        yield from _rate(machine, short, "XYZ", 1, 20, FINE, SHORT_RATE)
        machine.send(ALONE)
        yield from _rate(machine, short, "X", 1, 220, COARSE, SHORT_RATE)
        yield Figure("faults with short pulses", "", engine.get("fault"), most=0)


def report(found: Iterable[Figure], path: Path | None) -> int:
    """Print figures, write them to a file if there is one, and return the exit status."""
    found = list(found)
    for figure in found:
        say(str(figure))
    facts: dict[str, Any] = {each.name: {**each._asdict(), "right": each.right} for each in found}
    if path:
        write_atomically(path, (json.dumps(facts, indent=1) + "\n").encode())
    return 0 if all(each.right for each in found) else 1


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.gcode", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--blocks", metavar="N", type=whole(10, 10**7), default=1000,
                        help="short lines to stream (default: %(default)s)")
    parser.add_argument("--stops", metavar="N", type=whole(1, 10**4), default=24,
                        help="stops by a limit switch (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to a file")
    args = parser.parse_args(argv)
    if args.json:
        check_output(args.json)
    found: list[Figure] = []
    with Progress(19, "figures", "measuring") as progress:
        for figure in figures(args.blocks, args.stops):
            found.append(figure)
            progress.advance()
    return report(found, args.json)


if __name__ == "__main__":
    raise SystemExit(main())
