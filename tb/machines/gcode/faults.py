# amaranth: UnusedElaboratable=no

"""Fault injection into `gcode`: its motors, what a reset keeps, and work."""

import random
from dataclasses import replace

from fresa.machines.gcode import GCode
from fresa.protocol import SETTINGS
from tb import boards
from tb.faults.gcode import PLANNED, GCodeSession
from tb.faults.rows import Rows
from tb.faults.session import BYTE, sessions_and_fuzz
from tb.faults.target import FaultTarget, Line, Pulses

from . import SHORT
from .fuzz import AXES, BIT, FUZZ

__all__ = ["FAULTS", "sessions", "target"]

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
    "reporter.texts.fetch__data", "settings.fact__data", "settings.facts",
    "settings.$signature__data")
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
              "contacts.count", "contacts.tick",
              *(f"contacts.ticks_{number}" for number in range(7)),
              *(f"setting_{each.number}" for each in SETTINGS), "period", "pulse_width",
              "interpreter.line.word",
              *(f"motion.walk.{name}" for name in OF_WALK), *OF_MEMORIES),
        work=lambda seed: _work(seed, DEEDS),
        work_to_reset=sessions_and_fuzz(list(design.inputs), FUZZ, sessions),
        gap=20_000, window=12_000, timeout=60_000, line=Line(BIT, b"oe", _question()),
        shared=150)


FAULTS = {None: target}
"""Its builds for fault injection; it has no guard."""


def _session(rng: random.Random) -> GCodeSession:
    return GCodeSession(rng, OTHERS, axes=AXES, digits=3, feed=9000, brake=4000)


def _work(seed: int, count: int) -> Rows:
    """Give so many pieces of work, as a program sends them that waits for the machine.

    No place is called otherwise on the way, so the positions are the steps from the last reset on.
    At the end the machine rests.
    """
    rng = random.Random(seed)
    s = _session(rng)
    s.hold(4 * BYTE)
    s.send(b"G91F9000\n", PLANNED)
    s.rest()
    for _ in range(count):
        kind = rng.randrange(12)
        if kind < 3:
            s.move_several()
        elif kind == 3:
            size = rng.uniform(0.05, 0.2)
            s.send(f"G{rng.choice('23')}X{size:.3f}Y0Z0.05R{size:.3f}\n".encode(), 2 * PLANNED)
        elif kind == 4:
            s.hold_feed()
        elif kind == 5:
            s.reset_softly()
        elif kind == 6:
            s.stop("limits", "stop", "motor_fault")
        elif kind == 7:
            s.send(rng.choice([b"G5\n", b"X1X2\n", b"G4P0.002\n", b"M3S500\n", b"G20\nG21\n",
                               b"?", b"$G\n", b"G90\nG91\n", b"M8\nM9\n"]), 2 * PLANNED)
        elif kind == 8:
            s.jog()
        elif kind == 9:
            s.send(b"G38.3Z-0.3\n", s.moving())
            s.tap("probe", clocks=8000)
        elif kind == 10:
            s.send(b"M5M9\n", 2 * PLANNED)  # they would take seconds to start again
            s.move(s.moving())
            s.tap("door", clocks=8000)
            s.send(b"~", 200)
        else:
            s.reset_all()
        s.rest()
    s.rest()
    s.hold(200)
    return s.written


def sessions(seed: int) -> Rows:
    """Give sessions of which each soon moves all motors; work begins one after each reset."""
    s = _session(random.Random(seed))
    for _ in range(40):
        s.begin()
        s.send(b"G91F9000\n")
        s.interrupt(8000, b"!", b"\x18", b"?", b"~", b"$32=1", b"G2X0.2I0.1", b"$J=G91X1F900",
                    b"M3S500")
    return s.written


def _question() -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give lines, how many answers of each kind they have, and where the motors go for them.

    Where a contact was on in the reset the machine is locked, or stands still; but it answers,
    behind its messages of that.
    """
    s = _session(random.Random(0))
    s.hold(4 * BYTE)
    s.send(b"\x18", 1000)
    s.send(b"$X\nG21G91G1X.05Y-.025Z.0125F9000\nX1X2\n", 120 * BYTE)
    s.rest(30 * BYTE)
    return s.written, (2, 1), (4, -2, 1)
