# amaranth: UnusedElaboratable=no

"""Fault injection into `vplotter`: its motors, what a reset keeps, and work."""

import random
from dataclasses import replace
from fractions import Fraction
from functools import partial
from math import hypot

from fresa.drive import HALF_STEP
from fresa.machines.vplotter import VPlotter, VPlotterSettings
from fresa.protocol import SETTINGS
from tb import boards
from tb.faults.gcode import PLANNED, GCodeSession
from tb.faults.rows import Rows
from tb.faults.session import BYTE, sessions_and_fuzz
from tb.faults.target import Coils, FaultTarget, Line

from ..gcode.faults import OF_MEMORIES, OF_WALK
from . import SHORT
from .fuzz import FUZZ
from .fuzz_check import BIT

__all__ = ["BOWED", "BUILT", "FAULTS", "sessions", "target"]

BUILT = replace(
    SHORT, wall_width=10, wall_height=10, least_y=2, rest=(5, 5), string_steps=Fraction(24),
    string_rate=6000, max_rate=(Fraction(8000), Fraction(8000), Fraction(60_000)))
"""Strings are fine, so that there is a step soon, and short, so that homing is through soon."""

BOWED = replace(
    BUILT, bowed=True, string_steps=Fraction(8), string_rate=10_000,
    max_rate=(Fraction(40_000), Fraction(40_000), Fraction(60_000)))
"""Strings are coarser and faster: only behind homing there are lines that are bowed."""

DEEDS = 8
"""Pieces of a work."""

OTHERS = "limits", "stop", "door", "motor_fault", "hold", "start", "abort"
"""Inputs beside the line."""

SIDES = "left", "right"

BEYOND = 2
"""Steps from where a switch closes to where it opens again."""

DRAWN = 20_000
"""Clocks in which the longest of bowed lines is drawn, and more."""


def _rest(built: VPlotterSettings) -> int:
    """Return the steps of either string at the place of rest, below the middle of the pulleys."""
    return round(float(built.string_steps) * hypot(*built.rest))


def target(built: VPlotterSettings = BUILT) -> FaultTarget:
    """Return the machine with a small wall, and fine strings, or one that draws bowed lines.

    A reset does not set the rows and the coils of its motors, and the times since their last
    steps; the levels of its contacts, and for how long they have been other ones; its settings, and
    the outputs that a program has set, which motions take over; nor what its memories gave last,
    the last word of a line, and what is left in the walk of a segment, of which nothing is used
    before it is given anew.
    """
    design = boards.component("vplotter", VPlotter(settings=built))
    return FaultTarget(
        "vplotter-bowed" if built.bowed else "vplotter", design,
        tuple(Coils(f"the motor of the {side} string", f"motor_{side} made", side, HALF_STEP,
                    may_be_off=True, first=_rest(built)) for side in SIDES),
        idle=("moving", 0), fault="fault", origin={"rst": 1},
        kept=(*(f"motor_{side}.driver.{name}" for side in SIDES
                for name in ("row", "coils", "rest")),
              "contacts.count", "contacts.tick",
              *(f"contacts.ticks_{number}" for number in range(7)),
              *(f"setting_{each.number}" for each in SETTINGS), "period",
              "interpreter.line.word",
              *(f"motion.walk.{name}" for name in OF_WALK), *OF_MEMORIES,
              "dialect.texts.fetch__data"),
        work=lambda seed: _work(seed, DEEDS, built),
        work_to_reset=sessions_and_fuzz(
            list(design.inputs), FUZZ.others[0] if built.bowed else FUZZ,
            partial(sessions, built=built)),
        gap=60_000 if built.bowed else 25_000, window=12_000,
        timeout=120_000 if built.bowed else 80_000,
        line=Line(BIT, b"oe", _question(built)), shared=150)


FAULTS = {None: target, "bowed": partial(target, BOWED)}
"""Its builds for fault injection; it has no guard."""


def _session(rng: random.Random) -> GCodeSession:
    return GCodeSession(rng, OTHERS, axes="XY", digits=2, feed=8000, brake=8000)


def _home(s: GCodeSession, built: VPlotterSettings) -> None:
    """Home from the place of rest, with switches where the strings have their length by the count.

    So the count goes on where it was.
    """
    def meet(switch: int, steps: int) -> None:
        """Close a switch behind so many steps, and open it when some are taken back."""
        s.hold((2 * steps + 1) * built.pace // 2)
        s.set_contact("limits", switch)
        s.hold((8 * BEYOND + 4) * built.pace)
        s.set_contact("")

    rest = _rest(built)
    s.send(b"$H\n", 1)
    meet(1, rest + BEYOND)
    meet(2, 2 * rest + 2 * BEYOND)  # it was paid out meanwhile
    s.hold((rest + 2 * BEYOND + 4) * built.pace)
    s.rest(PLANNED)


def _place(rng: random.Random, built: VPlotterSettings) -> bytes:
    """Return a point close to the place of rest, of a command: others are too long a way off."""
    return b"%04d%04d" % tuple(each + rng.randint(-3, 3) for each in built.rest)


def _draw(s: GCodeSession, rng: random.Random, built: VPlotterSettings) -> None:
    """Draw a bowed line, and ask for states; or reset it all within it.

    What ends it otherwise makes the machine take another place for its own.
    """
    s.send(b":I" + _place(rng, built) + b"\n", PLANNED)
    s.rest()
    s.send(b":F" + _place(rng, built) + b"\n", rng.randint(1, 12_000))
    if rng.random() < 0.3:
        s.reset(rng.choice([1, 1, 2, 20]))
        s.unlock()
        return
    s.send(rng.choice([b":S0\n", b":S1\n:S2\n", b"?", b":I00050005\n", b":P1\n"]), DRAWN)


def _work(seed: int, count: int, built: VPlotterSettings) -> Rows:
    """Give so many pieces of work, as a program sends them that waits for the machine.

    The strings have the lengths that their motors have made, from the last reset on. At the end the
    machine rests.
    """
    rng = random.Random(seed)
    s = _session(rng)
    s.hold(PLANNED)
    if rng.random() < (0.8 if built.bowed else 0.3):
        _home(s, built)
        s.send(b"G91F8000\n", PLANNED)
    else:
        s.unlock()
    s.rest()
    for _ in range(count):
        if built.bowed and rng.random() < 0.4:
            _draw(s, rng, built)
            s.rest()
            continue
        kind = rng.randrange(11)
        if kind < 3:
            s.move_several()
        elif kind == 3:
            size = rng.uniform(0.05, 0.2)
            s.send(f"G{rng.choice('23')}X{size:.3f}Y0R{size:.3f}\n".encode(), 2 * PLANNED)
        elif kind == 4:
            s.hold_feed()
        elif kind == 5:
            s.reset_softly()
        elif kind == 6:
            s.stop("limits", "stop", "motor_fault")
        elif kind == 7:
            s.send(rng.choice([b"G5\n", b"X1X2\n", b"G4P0.002\n", b"M3\n", b"M5\n", b"Z.1\nZ-.1\n",
                               b"?", b"$G\n", b"G90\nG91\n", b":S0\n", b":P1\n", b":I00050005\n",
                               b":Z\n"]), 2 * PLANNED)
        elif kind == 8:
            s.jog()
        elif kind == 9:
            s.move(s.moving())
            s.tap("door")
            s.hold(16_000)
            s.send(b"\x18", 2000)  # behind a resume the pen would take half a second
            s.unlock()
        else:
            s.reset_all()
        s.rest()
    s.rest()
    s.hold(200)
    return s.written


def sessions(seed: int, built: VPlotterSettings = BUILT) -> Rows:
    """Give sessions of which each soon moves the motors; work begins one after each reset."""
    rng = random.Random(seed)
    s = _session(rng)
    for _ in range(40):
        s.begin()
        if built.bowed and rng.random() < 0.7:
            _home_and_draw(s, rng, built)
            continue
        if rng.random() < 0.2:
            s.send(rng.choice([b"$H\n", b":H\n"]), rng.randint(1, 20_000))
            s.set_contact("limits", rng.choice([1, 2]))
            s.hold(rng.randint(1, 8000))
            s.set_contact("")
            continue
        s.send(b"$X\nG91F8000\n")
        s.interrupt(16_000, b"!", b"\x18", b"?", b"~", b":S0", b"$SLP", b"G2X0.2I0.1",
                    b":F00050005", b"$J=G91X1F900", b"M3")
    return s.written


def _home_and_draw(s: GCodeSession, rng: random.Random, built: VPlotterSettings) -> None:
    """Home with switches that close at once, and draw a bowed line."""
    s.hold(PLANNED)  # it has settled
    s.send(b":H\n", 1200)
    for switch in (1, 2):
        s.set_contact("limits", switch)
        s.hold(400)
        s.set_contact("")
        s.hold(600)
    s.hold((_rest(built) + 4) * built.pace)
    s.send(b":I00050005\n", 2 * PLANNED)  # it is there, and says so
    s.send(b":F" + _place(rng, built) + b"\n", rng.randint(1, 10_000))
    s.set_contact(rng.choice(OTHERS), rng.choice([0, 0, 1]))
    s.send(rng.choice([b"!~", b"?", b":S0\n", b":S1\n", b"\x85", b":P0\n", b"\x18"]), 4000)
    s.set_contact("")
    s.hold(8000)


def _question(built: VPlotterSettings) -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give lines, how many answers of each kind they have, and where the motors go for them.

    Where a contact was on in the reset the machine is locked, or stands still; but it answers,
    behind its messages of that.
    """
    s = _session(random.Random(0))
    s.hold(4 * BYTE)
    s.send(b"\x18", 1000)
    s.send(b"$X\nG21G91G1X.5Y-.25F8000\nX1X2\n", 120 * BYTE)
    s.rest(30 * BYTE)
    (across, below), (x, y) = built.rest, (0.5, 0.25)
    return s.written, (2, 1), tuple(
        round(float(built.string_steps) * hypot(place, below + y)) - _rest(built)
        for place in (across + x, built.wall_width - across - x))
