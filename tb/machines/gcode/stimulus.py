"""Stimulus for `gcode`: programs on its line, right, wrong and damaged, and its other inputs."""

import random
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fresa.machines.gcode import GCodeSettings

from ...stimulus import BLOCK
from ...uart import encode

__all__ = ["directed", "lines", "random_rows"]

HOMED = b"$22=1\n$H\n"
SQUARED = (
    ("limits", 0b100, 13_000, 16_000), ("second_limit", 1, 14_500, 17_000),
    ("second_limit", 1, 36_500, 44_000), ("limits", 0b100, 38_000, 44_000))
"""Levels of switches of the first axis that homes: where it is sought, and where it is located."""
HOMING = 60_000
"""Clocks after which the next axis has its turn."""

REALTIME = (b"?", b"?", b"?", b"!", b"~", b"~", b"~", b"\x18", b"\x84", b"\x85", b"\x90",
            b"\x91", b"\x92", b"\x96", b"\x95", b"\x9b", b"\x9e", b"\xa0", b"\xa1")
OTHERS = (b"M3 S1000", b"M5", b"M8", b"M9", b"M7", b"G4 P0.001", b"G4", b"M0", b"M2", b"G92 X1",
          b"G92.1", b"G10 L2 P1 X0.5", b"G54", b"G55", b"G20", b"G21", b"G91", b"G90", b"G28",
          b"G38.2 X0.3 Y0.1 F9000", b"G38.3 Z-0.2 F6000", b"G38.4 X0.1", b"G38.5 Y0.2 F9000",
          b"G38.2",
          b"$J=G91 X0.2 F900", b"$J=X0 Y0 F9000", b"$J=G0 X1 F1",
          b"$X", b"$H", b"$$", b"$", b"$G", b"$#", b"$I", b"$C", b"$C", b"$RST=#", b"",
          b"$N0=G55", b"$N1=", b"$I=(a)b", b"$N",
          b"$10=0", b"$10=1", b"$10=3", b"$13=1",
          b"(comment) G1", b"; all of it", b"G1 X", b"X1 X2", b"G1 G2 X1",
          b"F0", b"F9000", b"T1 N5", b"%", b"G93 G1 X1", b"G17", b"G18",
          b"G2 X0.1 Y0.1 I0.1", b"1e5", b"G1 X99999999999",
          b"G1 X0.00000000000000000000000000000000000001")


def lines(rng: random.Random) -> Iterator[bytes]:
    """Give lines without end: short motions, other words, and lines with bytes changed."""
    while True:
        if rng.random() < 0.6:
            size = rng.choice([0.02, 0.2, 1])
            words = [b"%c%.3f" % (axis, rng.uniform(-size, size)) for axis in b"XYZ"
                     if rng.random() < 0.6]
            line = rng.choice([b"G0", b"G1 F%d" % rng.randint(100, 12_000), b""]) + b"".join(words)
        else:
            line = rng.choice(OTHERS)
        if rng.random() < 0.1:
            line = bytes(rng.randrange(256) if rng.random() < 0.2 else byte for byte in line)
        yield line + rng.choice([b"\n", b"\r\n", b"\r"])


def _bytes(rng: random.Random) -> Iterator[bytes]:
    for line in lines(rng):
        yield line
        if rng.random() < 0.3:
            yield rng.choice(REALTIME)


def directed(settings: GCodeSettings, seed: int, clocks: int) -> dict[str, NDArray]:
    """Send lines, a pause after some of them; then press the buttons and the switches.

    Before them a machine with a second motor begins to home, and meets its switches.
    """
    rng = random.Random(seed)
    bit = settings.bit
    second = ["second_limit"] * (settings.second_motor is not None)
    levels = {name: np.zeros(clocks, np.uint8) for name in (
        "rst", "rx", "limits", "stop", "door", "probe", "motor_fault", "hold", "start", "abort",
        *second)}
    line: list[int] = [1] * 4000
    if second:
        line += encode(HOMED, bit)
        line += [1] * (HOMING - len(line))
    source = _bytes(rng)
    while len(line) < clocks:
        line += encode(next(source), bit) + [1] * (rng.choice([2, 2, 50, 1000]) * bit)
    levels["rx"][:] = line[:clocks]
    for name, level, begin, end in SQUARED if second else ():
        levels[name][begin:end] = level
    place = HOMING if second else 30_000
    while place < clocks:
        name = rng.choice(["hold", "start", "start", "abort", "limits", "stop", "door", "probe",
                           "motor_fault", "rst", *second])
        length = 1 if name == "rst" else rng.randint(1, 200)
        levels[name][place:place + length] = rng.randint(1, 7) if name == "limits" else 1
        place += rng.randint(10_000, 60_000)
    return levels


def random_rows(settings: GCodeSettings, seed: int, block: int, rows: int = BLOCK
                ) -> dict[str, NDArray]:
    """Return the first rows of a random block: lines close by each other, bytes, and noise."""
    rng = random.Random(f"{seed} {block}")
    bit = settings.bit
    line: list[int] = []
    source = _bytes(rng)
    while len(line) < BLOCK:
        kind = rng.randrange(12)
        if kind < 10:
            line += encode(next(source), bit) + [1] * (rng.choice([0, 1, 30, 200]) * bit)
        elif kind < 11:
            line += encode(rng.randbytes(rng.randint(1, 8)), bit)
        else:
            line += [level for _ in range(rng.randint(1, 20))
                     for level in [rng.getrandbits(1)] * rng.randint(1, 2 * bit)]
    levels = {"rx": line[:BLOCK]}
    for name, often in (("rst", 0), ("limits", 0.1), ("stop", 0.05), ("door", 0.1),
                        ("probe", 0.1), ("motor_fault", 0.05), ("hold", 0.3),
                        ("start", 0.5), ("abort", 0.1),
                        *[("second_limit", 0.1)] * (settings.second_motor is not None)):
        level = [0] * BLOCK
        for _ in range(8):
            if rng.random() < often:
                place = rng.randrange(BLOCK)
                for at in range(place, min(BLOCK, place + rng.randint(1, 400))):
                    level[at] = rng.randint(1, 7) if name == "limits" else 1
        levels[name] = level
    if rng.random() < 0.1:
        levels["rst"][rng.randrange(BLOCK)] = 1
    return {name: np.array(level[:rows], np.uint8) for name, level in levels.items()}
