"""Stimulus for `vplotter`: commands and G-code on its line, right and wrong, and its switches."""

import random
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fresa.machines.vplotter import VPlotterSettings

from ...stimulus import BLOCK
from ...uart import encode
from ..gcode.stimulus import lines as lines_of_gcode

__all__ = ["CONTACTS", "HOMED", "directed", "homing", "lines", "random_rows"]

CONTACTS = "stop", "door", "motor_fault", "hold", "start", "abort"

HOMED = 32_000
"""Clocks in which a homing cycle is through, with the switches of `homing`."""

COMMANDS = (b":P1", b":P0", b":H", b":h", b":S0", b":S1", b":s2", b":S3", b":", b":F", b":Q1",
            b":I001000105", b":P", b":I0010001x", b":H0", b":S")
REALTIME = b"?", b"?", b"!", b"~", b"~", b"\x18", b"\x85", b"\x9e", b"\x91"


def _place(rng: random.Random, settings: VPlotterSettings) -> bytes:
    """Give a point, most often one on the wall."""
    return b"%04d%04d" % (rng.randint(0, settings.wall_width + 2),
                          rng.randint(settings.least_y - 1, settings.wall_height + 1))


def lines(rng: random.Random, settings: VPlotterSettings) -> Iterator[bytes]:
    """Give lines without end: commands, G-code, and lines with bytes changed."""
    code = lines_of_gcode(rng)
    while True:
        kind = rng.random()
        if kind < 0.35:
            yield next(code)
            continue
        if kind < 0.8:
            line = rng.choice([b":I", b":F", b":F"]) + _place(rng, settings)
        else:
            line = rng.choice(COMMANDS)
        if rng.random() < 0.1:
            line = bytes(rng.randrange(256) if rng.random() < 0.2 else byte for byte in line)
        yield line + rng.choice([b"\n", b"\r\n", b"\r"])


def _bytes(rng: random.Random, settings: VPlotterSettings) -> Iterator[bytes]:
    for line in lines(rng, settings):
        yield line
        if rng.random() < 0.2:
            yield rng.choice(REALTIME)


def homing(limits: NDArray, begin: int) -> None:
    """Close the end switches as the strings would, in a cycle that begins in a clock."""
    for level, first, last in ((0b01, 3000, 6500), (0b10, 9000, 12_500)):
        limits[begin + first:begin + last] = level


def directed(settings: VPlotterSettings, seed: int, clocks: int) -> dict[str, NDArray]:
    """Home it, draw by commands and by G-code; then press the buttons and the switches."""
    rng = random.Random(seed)
    bit = settings.bit
    levels = {name: np.zeros(clocks, np.uint8) for name in ("rst", "rx", "limits", *CONTACTS)}
    line: list[int] = [1] * 4000 + encode(b":P1\n:S0\n:H\n", bit)
    homing(levels["limits"], len(line))
    line += [1] * 2000 + encode(b":S1\n:S2\n", bit)
    line += [1] * (4000 + HOMED - len(line))
    for text, pause in ((b":S0\n", 4000), (b":I00040005\n", 20_000), (b":F00120013\n", 3000),
                        (b":S0\n:S1\n", 20_000), (b":I00040012\n:F00040004\n", 30_000),
                        (b"G0X8Y4\nG2X5Y7R3F9000\nM3\nG1X7M5\n", 20_000)):
        line += encode(text, bit) + [1] * pause
    source = _bytes(rng, settings)
    while len(line) < clocks:
        line += encode(next(source), bit) + [1] * (rng.choice([2, 50, 1000]) * bit)
    levels["rx"][:] = line[:clocks]
    place = 150_000
    while place < clocks:
        name = rng.choice(["hold", "start", "start", "abort", "limits", "stop", "door",
                           "motor_fault", "rst"])
        length = 1 if name == "rst" else rng.randint(1, 200)
        levels[name][place:place + length] = rng.randint(1, 3) if name == "limits" else 1
        place += rng.randint(10_000, 60_000)
    return levels


def _homed(bit: int) -> tuple[list[int], NDArray]:
    """Return a block of the line, and of the end switches, in which it is reset and homed."""
    line = [1] * 2000 + encode(b"~\x18", bit) + [1] * 16_000  # it brakes, and texts wait
    line += encode(b"$RST=$\n:P1\n", bit) + [1] * 8000 + encode(b":H\n", bit)
    limits = np.zeros(BLOCK, np.uint8)
    homing(limits, len(line))
    return line + [1] * (BLOCK - len(line)), limits


def _drawing(rng: random.Random, settings: VPlotterSettings) -> list[int]:
    """Give the line in which it goes to a point near the place of rest, and draws to another."""
    near = b"%04d%04d" % tuple(each + rng.randint(-1, 1) for each in settings.rest)
    return (encode(b":I" + near + b"\n", settings.bit) + [1] * rng.randint(30_000, 40_000)
            + encode(b":F" + _place(rng, settings) + b"\n", settings.bit)
            + [1] * rng.randint(0, 20_000))


def random_rows(settings: VPlotterSettings, seed: int, block: int, rows: int = BLOCK
                ) -> dict[str, NDArray]:
    """Return the first rows of a random block: lines close by each other, bytes, and noise.

    In every fourth block it is homed instead, and the next one begins with a line that is drawn.
    """
    rng = random.Random(f"{seed} {block}")
    bit = settings.bit
    line, limits = encode(b"$X\n", bit) if block == 0 else [], np.zeros(BLOCK, np.uint8)
    if block % 4 == 1:
        line, limits = _homed(bit)
    elif block % 4 == 2:
        line = _drawing(rng, settings)
    first = len(line)  # from here on anything may happen
    source = _bytes(rng, settings)
    while len(line) < BLOCK:
        kind = rng.randrange(12)
        if kind < 10:
            line += encode(next(source), bit) + [1] * (rng.choice([0, 1, 30, 200]) * bit)
        elif kind < 11:
            line += encode(rng.randbytes(rng.randint(1, 8)), bit)
        else:
            line += [level for _ in range(rng.randint(1, 20))
                     for level in [rng.getrandbits(1)] * rng.randint(1, 2 * bit)]
    levels = {"rx": np.array(line[:BLOCK], np.uint8)}
    for name, often in (("rst", 0), ("limits", 0.3), ("stop", 0.05), ("door", 0.1),
                        ("motor_fault", 0.05), ("hold", 0.3), ("start", 0.5), ("abort", 0.1)):
        level = limits if name == "limits" else np.zeros(BLOCK, np.uint8)
        for _ in range(8):
            if first < BLOCK and rng.random() < often:
                place = rng.randrange(first, BLOCK)
                for at in range(place, min(BLOCK, place + rng.randint(1, 400))):
                    level[at] = rng.randint(1, 3) if name == "limits" else 1
        levels[name] = level
    if first < BLOCK and rng.random() < 0.1:
        levels["rst"][rng.randrange(first, BLOCK)] = 1
    return {name: level[:rows] for name, level in levels.items()}
