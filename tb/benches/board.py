"""The tests of the thesis, with the pins of the Nexys 2."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import product

import numpy as np

from fresa.machines import MillStation
from fresa.machines.mill import MillTiming
from fresa.motion import CoordinateGenerator, SquareGenerator

from ..bench import Run, bench
from ..boards import board
from ..engines import Engine
from ..milling import AUTOMATIC, BUTTON, DEBOUNCE, LED, SETTLE
from ..plant import WORDS, Plant
from .panel import SHAPES

PERIOD, SCAN_BITS, Z_TRAVEL = 4, 3, 5
AXES = ("axis_x", "axis_y", "axis_z")

SIDE = 0x123
"""Steps of the square's side: four different digits."""

PIXEL = 6
"""Steps per pixel."""

FIGURE = (
    "..#....",
    ".#.##..",
    ".#..##.",
    "#....#.",
    ".####..",
    "......#",
)


class Nexys2:
    """A board with its motors, for a bench."""

    def __init__(self, run: Run, engine: Engine, plant: Plant) -> None:
        self._run, self._engine, self.plant = run, engine, plant
        self._words = engine.get(*AXES)
        self.clocks(0)

    def clocks(self, clocks: int) -> list[dict[str, int]]:
        """Continue; return the new words of axes that stepped, a row for each such clock."""
        changes = self._engine.run(clocks, AXES)
        self.plant.feed(changes)
        self._run.expect("coil words that no motor can follow", self.plant.faults, [])
        steps = []
        for words in zip(*(changes[axis].tolist() for axis in AXES), strict=True):
            new = {axis: word for axis, word, old in zip(AXES, words, self._words, strict=True)
                   if word != old}
            steps += [new] if new else []
            self._words = words
        return steps

    def switch(self, switches: int) -> list[dict[str, int]]:
        """Set the switches, and continue until they have been sampled."""
        self._engine.set(switches=switches)
        return self.clocks(SETTLE)

    def jog(self, way: tuple[int, ...], steps: int) -> list[dict[str, int]]:
        """Jog axes up (1) and down (-1) for the duration of a number of steps."""
        switches = sum({0: 0b00, 1: 0b01, -1: 0b10}[up] << 2 * axis for axis, up in enumerate(way))
        seen = self.switch(switches) + self.clocks(PERIOD * steps - SETTLE)
        first = next(axis for axis, up in enumerate(way) if up)
        leds, words = self._engine.get("leds") & 0b1111, self._engine.get(*AXES)
        self._run.expect("LD3 to LD0", leds, words[first], bits=4)
        return seen + self.switch(0)

    def press(self, button: str) -> None:
        """Press a button and release it."""
        for level in (BUTTON[button], 0):
            self._engine.set(buttons=level)
            self.clocks(SETTLE)

    def lit(self, led: str) -> bool:
        """Return whether an LED is on."""
        return bool(self._engine.get("leds") & LED[led])

    def wait(self, done: Callable[[], bool], what: str, state: str, within: int = 5000) -> None:
        """Continue until `done()`: until `what` is in a state."""
        end = self._engine.clock + within
        while not done():
            if self._engine.clock >= end:
                self._run.expect(what, f"not in {within} clocks", state)
            self.clocks(2)

    def display(self) -> str:
        """Read the display, digit by digit, over two turns of all four."""
        read = ["?"] * 4
        for _ in range(8 << SCAN_BITS):
            digits, segments = self._engine.get("digits", "segments")
            for place in range(4):
                if not digits >> place & 1:
                    read[3 - place] = f"{SHAPES[segments]:X}" if segments in SHAPES else "?"
            self.clocks(1)
        return "".join(read)


@contextmanager
def nexys2(
    run: Run, source: CoordinateGenerator | SquareGenerator, plant: Plant, *, counts: bool = False,
) -> Iterator[Nexys2]:
    """Return a board after power-up; its waveform shows the axis counters on request."""
    timing = MillTiming(period=PERIOD, scan_bits=SCAN_BITS)
    design = board("mill", MillStation(source=source, timing=timing, z_travel=Z_TRAVEL),
                   debounce=DEBOUNCE)
    inside = [f"machine.mill.controller.automatic.{axis}.count" for axis in "xyz"] if counts else []
    with run.engine(design, inside=inside) as engine:
        yield Nexys2(run, engine, plant)


@bench
def jog_axes(run: Run) -> str:
    """Each axis jogged in both directions by the switches; coil words at the pins."""
    with nexys2(run, SquareGenerator(side=1), Plant()) as board:
        for axis, name in enumerate(AXES):
            for up, words in [(1, WORDS[1:] + WORDS[:1]), (-1, WORDS[::-1])]:
                way = tuple(up if other == axis else 0 for other in range(3))
                seen = [", ".join(f"{moved} {word:04b}" for moved, word in step.items())
                        for step in board.jog(way, 8)]
                run.expect("words", seen, [f"{name} {word:04b}" for word in words * 2])
                at = tuple(8 * (up > 0) * (other == axis) for other in range(3))
                run.expect("position", board.plant.position, at)
    return ("X, Y and Z, 8 steps up and 8 back each, along the coil table, while the others stood; "
            "the LEDs showed the word")


@bench
def jog_combinations(run: Run) -> str:
    """Every combination of axes and directions at once, by the switches."""
    ways = [way for way in product((0, 1, -1), repeat=3) if any(way)]
    with nexys2(run, SquareGenerator(side=1), Plant()) as board:
        for way in ways:
            before = board.plant.position
            seen = board.jog(way, 4)
            moving = [name for name, up in zip(AXES, way, strict=True) if up]
            run.expect(f"axes in each step, jogged {way}", list(map(list, seen)), [moving] * 4)
            made = tuple(b - a for a, b in zip(before, board.plant.position, strict=True))
            run.expect(f"steps, jogged {way}", made, tuple(4 * up for up in way))
        run.expect("position at the end", board.plant.position, (0, 0, 0))
    return f"{len(ways)} combinations, 4 steps each, all axes in the same clocks; back at the start"


@bench
def square(run: Run) -> str:
    """BTN1 walks a square; the counts at its corners are read from the display."""
    main, x, y = (AUTOMATIC | select for select in range(3))
    corners = []
    with nexys2(run, SquareGenerator(side=SIDE), Plant(), counts=True) as board:

        def read(select: int, expected: int) -> None:
            board.switch(select)
            run.expect("display", board.display(), f"{expected:04X}")

        def corner(*there: int) -> None:
            board.wait(lambda: board.plant.position == (*there, 0), "tool", f"at {there}")
            corners.append(there)

        read(x, 0)
        run.expect("LD7, ready", board.lit("ready"), True)
        board.press("start")
        corner(SIDE, 0)
        read(x, SIDE)  # while Y moves
        corner(SIDE, SIDE)
        read(y, SIDE)  # while X moves
        corner(0, SIDE)
        read(x, 0)
        corner(0, 0)
        read(y, 0)
        read(main, SIDE)  # of the last side
        run.expect("LD5, busy", board.lit("busy"), False)
        run.expect("LD6, error", board.lit("error"), False)
    return (f"corners {', '.join(map(str, corners))}, by the coils; "
            f"the display read {SIDE:04X} and 0000 where it should")


@bench
def image(run: Run) -> str:
    """BTN1 mills a figure; the plate is compared with it, pixel by pixel."""
    target = np.array([[pixel == "#" for pixel in row] for row in FIGURE])
    plant = Plant(target, pitch=PIXEL, travel=Z_TRAVEL)
    source = CoordinateGenerator(target.tolist(), pixel_steps=PIXEL)
    with nexys2(run, source, plant, counts=True) as board:
        board.switch(AUTOMATIC)
        board.press("start")
        run.expect("LD5, busy", board.lit("busy"), True)
        board.wait(lambda: not board.lit("busy"), "LD5", "dark", within=20_000)
        run.expect("LD6, error", board.lit("error"), False)
        board.clocks(2)  # the pipeline to the pins
        for pixel in np.ndindex(target.shape):
            cut, goal = ("milled" if plate[pixel] else "left" for plate in (plant.cut, target))
            run.expect(f"pixel {pixel}", cut, goal)
        run.expect("steps in the plate beside the figure", plant.wrong, [])
        run.expect("position at the end", plant.position, (0, 0, 0))
    return (f"{plant.cut.sum()} of {target.sum()} pixels milled in {plant.lifts} strokes, nothing "
            "beside them; back at the origin, raised")
