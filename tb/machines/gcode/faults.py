# amaranth: UnusedElaboratable=no

"""Fault injection into `gcode`: its motors, what a reset keeps, and work."""

import random
from dataclasses import replace

from fresa.machines.gcode import GCode
from fresa.protocol import SETTINGS
from tb import boards
from tb.faults.rows import Rows
from tb.faults.session import BYTE, Session, sessions_and_fuzz
from tb.faults.target import FaultTarget, Line, Pulses

from . import SHORT
from .fuzz import AXES, BIT, FUZZ

__all__ = ["FAULTS", "sessions", "target"]

PLANNED = 6000
"""Clocks in which a line has begun to move, or was answered."""

BUILT = replace(SHORT, low_ns=1500, setup_ns=1000, hold_ns=2000)

DEEDS = 8
"""Pieces of a work."""

OTHERS = "limits", "stop", "door", "probe", "motor_fault", "hold", "start", "abort"
"""Inputs beside the line."""

OF_DRIVERS = "step_pin", "direction_pin", "enable_pin", "wait"

OF_MEMORIES = (
    "buffer.fetch__data", "interpreter.coordinates.read__data", "interpreter.coordinates.fetched",
    "motion.nominal.read__data", "motion.queue.read__data", "planner.following__data",
    "planner.formulas.following__data", "planner.formulas.read__data", "planner.show__data",
    "reporter.texts.fetch__data", "settings.fact__data", "settings.$signature__data")
"""Registers that memories have at their outputs: block RAM gives something in every clock."""

OF_WALK = (
    "clockwise", "exponent", *(f"{name}_{axis}" for name in ("increment", "prepared")
                               for axis in range(3)), "prepared_turns", "turns",
    "ratio.added", "ratio.direction", "ratio.residual", "ratio.step",
    *(f"rotator.{name}" for name in ("adding", "amount", "first", "shifted", "source_is_x",
                                     "target", "vector")),
    *(f"{channel}.{name}" for channel in "uvw" for name in ("direction", "fraction", "quarter",
                                                            "step")))
"""Registers of the walk: each segment sets them before it makes a step of them."""


def target() -> FaultTarget:
    """Return the machine with the lowest of clocks, and unlike times of its driver modules.

    A reset does not set the pins of its driver modules and the timers of these; the levels of its
    contacts, and for how long they have been other ones; its settings, and the outputs that a
    program has set, which motions take over; nor what its memories gave last, the last word of a
    line, and what is left in the walk of a segment, of which nothing is used before it is given
    anew.
    """
    design = boards.component("gcode", GCode(settings=BUILT))
    times = BUILT.driver
    return FaultTarget(
        "gcode", design,
        tuple(Pulses(name, f"position_{name}", bit,
                     (times["width"], times["low"], times["setup"], times["hold"]))
              for bit, name in enumerate(AXES.lower())),
        idle=("moving", 0), fault="fault", origin={"rst": 1},
        kept=(*(f"driver_{axis}.{name}" for axis in AXES.lower() for name in OF_DRIVERS),
              *(f"contact_{number}.{name}" for number in range(7)
                for name in ("count", "enough", "o")),
              *(f"setting_{each.number}" for each in SETTINGS), "period", "pulse_width",
              "interpreter.line.word",
              *(f"motion.walk.{name}" for name in OF_WALK), *OF_MEMORIES),
        work=lambda seed: _work(seed, DEEDS),
        work_to_reset=sessions_and_fuzz(list(design.inputs), FUZZ, sessions),
        gap=20_000, window=12_000, timeout=60_000, line=Line(BIT, b"oe", _question()),
        shared=150)


FAULTS = {None: target}
"""Its builds for fault injection; it has no guard."""


def _session() -> Session:
    return Session(*[0] * len(OTHERS))


def _pressed(name: str, level: int = 1) -> tuple[int, ...]:
    return tuple(level if other == name else 0 for other in OTHERS)


def _way(rng: random.Random, most: float) -> str:
    return "".join(f"{axis}{rng.uniform(-most, most):.3f}" for axis in AXES)


def _work(seed: int, count: int) -> Rows:
    """Give so many pieces of work, as a program sends them that waits for the machine.

    No place is called otherwise on the way, so the positions are the steps from the last reset on.
    At the end the machine rests.
    """
    rng, s = random.Random(seed), _session()

    def move(clocks: int = PLANNED) -> None:
        s.send(f"G1{_way(rng, 0.4)}\n".encode(), clocks)

    def press(name: str, level: int = 1, clocks: int = 200) -> None:
        s.press(*_pressed(name, level))
        s.hold(clocks)
        s.press(*_pressed(name, 0))
        s.hold(100)

    def begin() -> None:
        """Begin anew after a reset, be it locked."""
        s.send(b"$X\nG91F9000\n", PLANNED)

    s.hold(4 * BYTE)
    s.send(b"G91F9000\n", PLANNED)
    s.rest()
    for _ in range(count):
        kind = rng.randrange(12)
        if kind < 3:  # several lines, planned together
            for _ in range(rng.randint(1, 3)):
                move(BYTE)
            s.hold(PLANNED)
        elif kind == 3:
            size = rng.uniform(0.05, 0.2)
            s.send(f"G{rng.choice('23')}X{size:.3f}Y0Z0.05R{size:.3f}\n".encode(), 2 * PLANNED)
        elif kind == 4:
            move(PLANNED + rng.randint(1, 4000))
            s.send(b"!", rng.randint(1, 8000))
            s.send(b"~", rng.randint(1, 2000))
            s.hold(8000)
            s.send(b"~", 200)  # the one before does nothing while it still slows down
        elif kind == 5:
            move(rng.randint(1, 12_000))
            s.send(b"\x18", 10_000)
            begin()
        elif kind == 6:  # stops at once, until a reset
            move(PLANNED + rng.randint(1, 4000))
            press(rng.choice(["limits", "stop", "motor_fault"]))
            s.send(b"\x18", 2000)
            begin()
        elif kind == 7:
            s.send(rng.choice([b"G5\n", b"X1X2\n", b"G4P0.002\n", b"M3S500\n", b"G20\nG21\n",
                               b"?", b"$G\n", b"G90\nG91\n", b"M8\nM9\n"]), 2 * PLANNED)
        elif kind == 8:
            s.send(f"$J=G91F9000{_way(rng, 0.4)}\n".encode(), PLANNED + rng.randint(1, 4000))
            s.send(b"\x85", 8000)
        elif kind == 9:
            s.send(b"G38.3Z-0.3\n", PLANNED + rng.randint(1, 4000))
            press("probe", clocks=8000)
        elif kind == 10:
            move(PLANNED + rng.randint(1, 4000))
            press("door", clocks=8000)
            s.send(b"~", 200)
        else:
            move(rng.randint(1, 12_000))
            s.reset(rng.choice([1, 1, 2, 20]))
            begin()
        s.rest()
    s.rest()
    s.hold(200)
    return s.written


def sessions(seed: int) -> Rows:
    """Give sessions of which each soon moves all motors; work begins one after each reset."""
    rng, s = random.Random(seed), _session()
    for _ in range(40):
        s.begin()
        s.send(b"G91F9000\n")
        for _ in range(3):
            s.send(f"G1{_way(rng, 1)}\n".encode(), rng.randint(1, 2000))
        s.hold(rng.randint(1, 8000))
        s.press(*_pressed(rng.choice(OTHERS), rng.choice([0, 1])))
        s.send(rng.choice([b"!", b"\x18", b"?", b"~", b"$32=1", b"G2X0.2I0.1", b"$J=G91X1F900",
                           b"M3S500"]) + b"\n", 4000)
        s.press(*_pressed("", 0))
    return s.written


def _question() -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give lines, how many answers of each kind they have, and where the motors go for them.

    Where a contact was on in the reset the machine is locked, or stands still; but it answers,
    behind its messages of that.
    """
    s = _session()
    s.hold(4 * BYTE)
    s.send(b"\x18", 1000)
    s.send(b"$X\nG21G91G1X.05Y-.025Z.0125F9000\nX1X2\n", 120 * BYTE)
    s.rest(30 * BYTE)
    return s.written, (2, 1), (4, -2, 1)
