"""What the line of `vplotter` is fuzzed with, and how a session is checked.

Nothing is looked at but pins. A session ends with a reset in whatever goes on, and a motion to the
place of rest. There both strings must be as long as where it began, or as after its last homing
cycle: a motor that has lost a step, or made one too many, does not get there.
"""

import random
from collections.abc import Callable
from dataclasses import replace

from fresa.machines.vplotter import VPlotter, VPlotterSettings
from tb import boards
from tb.fuzz.inputs import LineProtocol
from tb.fuzz.target import FuzzTarget

from . import SHORT
from .fuzz_bowed import ANEW, BOWED, sequence
from .fuzz_check import BIT, ROOM, check, check_bowed

__all__ = ["ANEW", "FUZZ", "HOME"]

X, Y = SHORT.rest[0], SHORT.wall_height - SHORT.rest[1]
"""Place of rest in coordinates of G54, y up."""

LINES = (b"G21", b"G90", b"G90", b"G54", b"G17", b"M3S500", b"M4", b"M5", b"M8", b"M9",
         b"G4P0.001", b"G92X0.1", b"G92.1", b"G43.1Z0.1", b"G49", b"$X", b"G94", b"G80", b"T1",
         b"(a comment) G1", b"; and no more", b"", b"X1X2", b"G1X", b"G2X1", b"M30", b"G38.2X8",
         b"$", b"$G", b"$#", b"$I", b"$N", b"$$", b"%", b" :S0")

COMMANDS = (b":P1", b":S0", b":S1", b":s2", b":S3", b":", b":F", b":Q1", b":I001000105", b":P",
            b":p2", b":I0010001x", b":H0", b":S", b":f00080020", b":I99990008")

ANOTHER = (b":P0", b":p0\n:P1", b"$SLP", b"$C", b"$RST=#", b"$rst=$", b"$J=G91X0.2F900",
           b"$j=G91Y-.3Z.1F60000", b"$J=X8Y8F9000", b"$21=0", b"$10=0", b"$13=1", b"$32=1",
           b"$1=255", b"$N0=G54", b"$N1=")

COMMANDS_WITHIN = (b"?", b"?", b"?", b"!~", b"~", b"\x85", *(
    bytes([code]) for code in (0x90, 0x91, 0x93, 0x94, 0x95, 0x96, *range(0x99, 0x9F))))
"""Real-time commands within lines: none that makes motion much slower."""

HOME = b"G90G94G53G0X%dY%dZ0\n" % (SHORT.rest[0] - SHORT.wall_width, SHORT.least_y - SHORT.rest[1])
"""To the place of rest, in coordinates of the machine."""


def _place(rng: random.Random) -> tuple[float, float]:
    """Give a point close to the place of rest, or one on the wall."""
    if rng.random() < 0.1:
        return rng.uniform(0, SHORT.wall_width), rng.uniform(
            0, SHORT.wall_height - SHORT.least_y)
    size = rng.choice([0.3, 1, 2])
    return X + rng.uniform(-size, size), Y + rng.uniform(-size, size)


def _motion(rng: random.Random) -> bytes:
    """Give a line of a motion, most often a short one."""
    x, y = _place(rng)
    words = "".join(word for word in (f"X{x:.3f}", f"Y{y:.3f}", f"Z{rng.uniform(-0.3, 0.3):.2f}")
                    if rng.random() < 0.6)
    return rng.choice([
        f"G0{words}", f"G1{words}F{rng.randint(9000, 60_000)}", words, f"G90 {words}",
        f"G91G{rng.choice('23')}X0Y0I{rng.uniform(-0.5, 0.5):.3f}F30000 G90",
        f"G91X{rng.uniform(-0.3, 0.3):.2f} G90"]).encode()


def _command(rng: random.Random) -> bytes:
    """Give a command of the thesis, most often one that draws."""
    if rng.random() < 0.4:
        return rng.choice(COMMANDS)
    x, y = (round(each) for each in _place(rng))
    return b":%c%04d%04d" % (rng.choice(b"IIFFif"), x, SHORT.wall_height - y)


def _legal(rng: random.Random) -> bytes:
    """Give a line; with real-time commands now and then."""
    kind = rng.random()
    if kind < 0.03:
        return ANEW
    if kind < 0.04:
        line = rng.choice([b":H", b":h", b"$H"])
    elif kind < 0.05:
        line = rng.choice(ANOTHER)
    elif kind < 0.35:
        line = _command(rng)
    elif kind < 0.8:
        line = _motion(rng)
    else:
        line = rng.choice(LINES)
    line += rng.choice([b"\n", b"\n", b"\r\n", b"\r"])
    if rng.random() < 0.1:
        place = rng.randrange(len(line) + 1)
        line = line[:place] + rng.choice(COMMANDS_WITHIN) + line[place:]
    return line


PROTOCOL = LineProtocol(
    legal=_legal, quiet=(b"\n", b":S0\n", b"X1X2\n", b"G5\n", b":\n", b"(quiet)\n", b"G1X\n"),
    end=b"\n", letters=b":PHIFSphGMXYZFR0123456789.-+ ()$?", longest=80, room=ROOM, answer=60,
    begin=b"$X\n$21=0\nG0Z20\n", alive=ANEW + HOME + b"\n" * 60, spared=b"\x18!\x84")


def _target(settings: VPlotterSettings, protocol: LineProtocol, checks: Callable[..., None],
            *others: FuzzTarget, about: str = "") -> FuzzTarget:
    return FuzzTarget(
        "vplotter", BIT, protocol,
        lambda: boards.component("vplotter", VPlotter(settings=settings)),
        ("tx", "left", "right", "pen", "servo", "moving", "fault"), checks, switches={"limits": 2},
        times=False, others=others, about=about)


FUZZ = _target(
    SHORT, PROTOCOL, check,
    _target(BOWED, replace(PROTOCOL, sequence=sequence), check_bowed),
    about="G-code and commands of the thesis; end switches close at random, which is no alarm, so "
          "that homing is through at times. Every other session is with bowed lines, of which each "
          "string is at a constant speed to the end point, and end switches and resets end some. "
          "Each session ends with a reset in what goes on, and a motion to the place of rest, "
          "where the strings must be as long as at first.")
