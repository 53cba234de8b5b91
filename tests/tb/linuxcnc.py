"""LinuxCNC's interpreter of G-code, `rs274`, as a second opinion on the language.

`python -m tests.tb.linuxcnc` writes docs/gcode-refused.md: what LinuxCNC takes and GRBL refuses.
"""

import cmath
import math
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fresa_host.gcode_lines import ERRORS
from tb.models.gcode_language import Arc, Interpreter, Line, RefusedLine, words

__all__ = ["MISSING", "Expanded", "Move", "expand", "packaged", "page", "run", "written"]

COMMAND = shutil.which("rs274")
MISSING = None if COMMAND else "rs274 missing: apt install linuxcnc-uspace"
PAGE = Path(__file__).parents[2] / "docs" / "gcode-refused.md"

INCH = 25.4
TIMEOUT_S = 60
PLANES = {"XY": (0, 1), "XZ": (2, 0), "YZ": (1, 2)}  # LinuxCNC calls ZX so, and gives Z first
G_OF_PLANE = {(0, 1): 17, (2, 0): 18, (1, 2): 19}

CODES = {
    "NURBS and splines": "G5 I1 J1 P1 Q1 X2 Y2 F100",
    "Thread": "M3 G33 Z1 K.5",
    "Radius compensation": "G41.1 D1",
    "Tool length of the table": "G43 H1",
    "Exact stop": "G61.1",
    "Path with tolerance": "G64 P.01",
    "Drill with chip breaking": "G73 Z-1 R1 Q.5 F100",
    "Drill": "G81 Z-1 R1 F100",
    "Drill with dwell": "G82 Z-1 R1 P.1 F100",
    "Peck drill": "G83 Z-1 R1 Q.5 F100",
    "Bore": "G85 Z-1 R1 F100",
    "Arc centres absolute": "G90.1",
    "G92 suspended": "G92.2",
    "G92 restored": "G92.3",
    "Feed per revolution": "G95",
    "Constant surface speed": "G96 D1000 S10",
    "Spindle in rev/min": "G97",
    "Return to the first level": "G98",
    "Return to level R": "G99",
    "Diameter": "G7",
    "Radius": "G8",
    "Tool table": "G10 L1 P1 Z1",
    "Rotated coordinates": "G10 L2 P1 X0 R10",
    "Further coordinate systems": "G59.1",
    "The same set": "G10 L20 P9 X1",
    "Arc of several turns": "G2 X0 Y0 I5 P2 F100",
    "Fourth axis": "G0 A10",
    "Polar coordinates": "G0 @1 ^45",
    "Parameters": "#1=5",
    "Values of parameters": "G0 X#1",
    "Expressions": "G0 X[1+1]",
    "Several signs": "G0 X--1",
    "Tool length and a movement in one line": "G43.1 G1 Z1 F100",
    "Radii of an arc that differ by 0.02 mm": "G2 X10 I4.99 F100",
    "Radius a little too small": "G2 X10 R4.999 F100",
    "Arc along the third axis alone": "G2 Z1 I1 F100",
    "Full circle without axes": "G2 I1 F100",
    "Line numbers above 10 000 000": "N99999999 G0 X1",
    "G80 and a movement in one line": "G80 G0 X1",
    "G80 and G28 by a place": "G28 G80 X1",
    "Subroutines and loops": "o1 if [1 EQ 1]\no1 endif",
    "Tool change": "T1 M6",
    "Orient the spindle": "M19 R0",
    "Overrides on": "M48",
    "Overrides off": "M49",
    "Feed override": "M50 P1",
    "Change of pallets": "M60",
    "Tool number set": "M61 Q1",
    "Digital output": "M62 P1",
    "Digital input": "M66 P1 L0",
    "Analog output": "M67 E0 Q1",
    "Modes saved": "M70",
}
"""What LinuxCNC takes, each with an example, and GRBL refuses."""


class Move(NamedTuple):
    """A movement; of an arc also its centre in the axes of its plane, from the start.

    Attributes
    ----------
    end : tuple of float
        In mm, in the machine's coordinates.
    feed : float or None
        In mm/min; None at the highest speed, or if it is not known.
    plane, centre, clockwise : optional
        Of an arc. The centre is in mm.
    turns : int
        Of an arc: 1 for up to a whole one.
    """

    end: tuple[float, float, float]
    feed: float | None = None
    plane: tuple[int, int] | None = None
    centre: tuple[float, float] = (0, 0)
    clockwise: bool = False
    turns: int = 1


@dataclass
class Expanded:
    """What an interpreter makes of a program.

    Attributes
    ----------
    moves : list of Move
        Up to the end, or to the line that is refused.
    refused : str
        Why a line is refused, empty if none is.
    """

    moves: list[Move] = field(default_factory=list)
    refused: str = ""


# Ours

def run(lines: Iterable[str]) -> Expanded:
    """Run a program on the model."""
    machine, found = Interpreter(), Expanded()
    for line in lines:
        try:
            actions = machine.line(words(line))
        except RefusedLine as refused:
            found.refused = f"{refused.args[0]}: {line}"
            return found
        for action in actions:
            if not isinstance(action, Line | Arc):
                continue
            feed = None if action.feed is None or action.inverse else action.feed * 60 / 1e6
            x, y, z = (at / 1e6 for at in action.target)
            move = Move((x, y, z), feed)
            if isinstance(action, Arc):
                u, v = (at / 1e6 for at in action.centre)
                move = Move((x, y, z), feed, action.plane, (u, v), action.clockwise)
            found.moves.append(move)
    return found


# LinuxCNC's

def packaged() -> list[Path]:
    """Return the programs that come with LinuxCNC, each once."""
    folder = Path(COMMAND or "/").resolve().parents[1] / "share"
    found = {path.read_bytes(): path for part in ("linuxcnc", "axis", "doc/linuxcnc")
             for path in sorted((folder / part).rglob("*.ngc"))}
    return sorted(found.values())


def _called(path: Path) -> str | Path:
    """Return a program that calls the subroutine that a file has, or the file if it has none.

    Its arguments are those that its comments propose, or 2.
    """
    text = path.read_text(encoding="latin-1")
    if not re.search(rf"^\s*o<{re.escape(path.stem)}>\s*sub", text, re.M | re.I):
        return path
    given = {int(number): value for number, value in re.findall(
        r"=\s*#(\d+)[^(\n]*\(=\s*(-?[\d.]+)", text)}
    most = max((int(number) for number in re.findall(r"=\s*#(\d{1,2})\b", text)), default=0)
    arguments = " ".join(f"[{given.get(number, 2)}]" for number in range(1, most + 1))
    return f"F100 S100\no<{path.stem}> call {arguments}\nM2\n"


@contextmanager
def _alone() -> Iterator[None]:
    """Keep other processes from running the interpreter.

    All that run at a time have the same shared memory, that of LinuxCNC's HAL, and some then end
    without a word.
    """
    import fcntl  # which is not there on Windows, as the interpreter is not

    with open(Path(tempfile.gettempdir()) / "fresa-rs274.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def expand(program: str | Path) -> Expanded:
    """Run a program, or a file, on LinuxCNC's interpreter.

    Parameters
    ----------
    program : str or Path
        Its text, which begins in mm, or the name of its file.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "p.var").touch()
        (folder / "tool.tbl").write_text("".join(f"T{n} P{n} Z{n} D.1\n" for n in range(1, 30)))
        libraries = {folder}
        if isinstance(program, Path):
            library = next((each for each in program.parents if each.name == "ngcgui_lib"), None)
            libraries |= {program.parent, *([library, library / "utilitysubs"] if library else [])}
            program = _called(program)
        if isinstance(program, str):
            (folder / "program.ngc").write_text(program)
            program = folder / "program.ngc"
        (folder / "machine.ini").write_text(
            f"[RS274NGC]\nSUBROUTINE_PATH = {':'.join(map(str, sorted(libraries)))}\n"
            "[TRAJ]\nLINEAR_UNITS = mm\n")
        with _alone():
            done = subprocess.run(
                [COMMAND or "rs274", "-i", "machine.ini", "-t", "tool.tbl", "-v", "p.var", "-g",
                 str(program)], cwd=folder, capture_output=True, encoding="latin-1", check=False,
                timeout=TIMEOUT_S)
    found = Expanded(list(_canonical(done.stdout)))
    if not re.search(r"PROGRAM_END\(|FINISH\(", done.stdout):
        complaint = [line for line in done.stderr.splitlines() if line != "executing"]
        found.refused = "; ".join(complaint[-2:]) or "no end"
    return found


def _canonical(text: str) -> Iterator[Move]:
    """Give the movements of canonical commands.

    Positions are printed in the units and coordinates of the program.
    """
    unit, plane, turn = 1.0, (0, 1), complex(1)
    offsets = {"G5X": [0.0] * 3, "G92": [0.0] * 3, "TOOL": [0.0] * 3}
    at, feed = (0.0, 0.0, 0.0), None

    def placed(numbers: Iterable[float]) -> tuple[float, float, float]:
        """Return a position in the machine's coordinates, in mm."""
        x, y, z = (number * unit + offset
                   for number, offset in zip(numbers, offsets["G92"], strict=True))
        turned = complex(x, y) * turn
        x, y, z = (sum(each) for each in zip((turned.real, turned.imag, z), offsets["G5X"],
                                             offsets["TOOL"], strict=True))
        return x, y, z

    for name, inner in re.findall(r"([A-Z0-9_]+)\((.*)\)\s*$", text, re.M):
        numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", inner)]
        if name == "USE_LENGTH_UNITS":
            unit = INCH if inner.endswith("INCHES") else 1.0
        elif name == "SELECT_PLANE":
            plane = PLANES[inner.rpartition("_")[2]]
        elif name in ("SET_G5X_OFFSET", "SET_G92_OFFSET", "USE_TOOL_LENGTH_OFFSET"):
            key = {"SET_G5": "G5X", "SET_G9": "G92", "USE_TO": "TOOL"}[name[:6]]
            offsets[key] = [number * unit for number in numbers[:3]]
        elif name == "SET_XY_ROTATION":
            turn = cmath.rect(1, math.radians(numbers[0]))
        elif name == "SET_FEED_RATE":
            feed = numbers[0] * unit
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED"):
            if name == "ARC_FEED":
                a, b = plane
                (c,) = {0, 1, 2} - {a, b}
                end, centre = [0.0] * 3, [0.0] * 3
                end[a], end[b], centre[a], centre[b], end[c] = numbers[:5]
                turns = int(inner.split(",")[4])
                centre = placed(centre)
                move = Move(placed(end), feed, plane, (centre[a] - at[a], centre[b] - at[b]),
                            turns < 0, abs(turns))
            else:
                move = Move(placed(numbers[:3]), feed if name == "STRAIGHT_FEED" else None)
            at = move.end
            yield move


def written(moves: Iterable[Move]) -> Iterator[str]:
    """Give movements as plain lines with G0 to G3, in mm and absolute."""
    yield "G21 G90 G94 G54"
    for move in moves:
        words = " ".join(f"{axis}{at:.6f}" for axis, at in zip("XYZ", move.end, strict=True))
        if move.plane is not None:
            centre = " ".join(f"{'IJK'[axis]}{at:.6f}"
                              for axis, at in zip(move.plane, move.centre, strict=True))
            words = (f"G{G_OF_PLANE[move.plane]} G{2 if move.clockwise else 3} {words} {centre} "
                     f"F{move.feed or 1:.4f}")
        else:
            words = f"G0 {words}" if move.feed is None else f"G1 {words} F{move.feed or 1:.4f}"
        yield words


# The page

def page() -> str:
    """Return the page of what LinuxCNC takes and GRBL refuses, after trying each."""
    rows = []
    for name, example in CODES.items():
        theirs = expand(f"G21 G90 F100 S100\n{example}\nM2\n")
        ours = run(example.split("\n"))
        if theirs.refused or not ours.refused:
            raise ValueError(f"{name}: {theirs.refused or 'not refused'}")
        code = int(ours.refused.partition(":")[0])
        rows.append(f"| {name} | `{example.splitlines()[0]}` | {code} | {ERRORS[code]} |")
    return "\n".join([
        "# What LinuxCNC takes and GRBL refuses", "",
        "Programs for LinuxCNC that use one of these end with an error on a machine that speaks "
        "the language of GRBL 1.1.",
        "Each line was tried with LinuxCNC's interpreter, `rs274`, and with the model of the "
        "language",
        "([gcode_language.py](../tb/models/gcode_language.py)); `python -m tests.tb.linuxcnc` "
        "writes this page.", "",
        "| LinuxCNC | example | error | why |", "| --- | --- | --- | --- |", *rows, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
