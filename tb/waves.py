"""Waveform files: a GTKWave save file next to each VCD, both written atomically."""

import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import log2
from pathlib import Path

from vcd.gtkw import GTKWColor, GTKWFlag, GTKWSave

from .engines import PERIOD

__all__ = ["HEX", "Layout", "Variable", "save_file", "staged", "variables"]

FEMTO = 1_000_000
"""Units of time of Amaranth's VCD in a nanosecond."""

HEX = {"count", "shown", "value"}
"""Names that are written in hexadecimal, as the display shows them."""

BITS = {
    "active", "allowed", "at_high", "at_low", "axes", "axis_x", "axis_y", "axis_z", "buttons",
    "coils", "digits", "direction", "high", "i", "jog", "jogging", "leds", "low", "moved", "o",
    "refused", "segments", "step", "switches",
}
"""Names that are written in binary: each bit is a coil, a segment, a switch or an axis."""

SIGNED = {"accumulator", "at_x", "at_y", "at_z", "place", "position", "target"}
"""Names of signed values: positions, and times until something is due."""

GRAPHS = ("x.count", "y.count", "z.count")
"""Positions that are drawn as curves."""

TOP = "bench.top"
"""Scope of the ports."""

WINDOW, NAMES, REST = (1500, 900), 220, 80
"""Size of the window, of its column of names, and of its frame, in pixels."""

FRAME = 200
"""GTKWave's zoom is minus the binary logarithm of the time that so many pixels show."""


@dataclass(frozen=True)
class Variable:
    """A variable of a VCD: its scopes, name and width. States are strings, with width 0."""

    scope: tuple[str, ...]
    name: str
    bits: int

    @property
    def path(self) -> str:
        """Its name in GTKWave's save files."""
        span = f"[{self.bits - 1}:0]" if self.bits > 1 else ""
        return ".".join((*self.scope, self.name)) + span


@dataclass(frozen=True)
class Layout:
    """Signals to show of a waveform.

    Attributes
    ----------
    design : str
        Scope of the design, below that of its ports.
    inputs, outputs : sequence of str
        Ports.
    inside : sequence of str
        Signals inside the design, such as ``x.count``.
    """

    design: str
    inputs: Sequence[str]
    outputs: Sequence[str]
    inside: Sequence[str] = ()


def variables(vcd: Path) -> list[Variable]:
    """Parse the variables that a VCD of Amaranth declares, one per line."""
    found: list[Variable] = []
    scope: list[str] = []
    with vcd.open(encoding="utf-8") as file:
        for line in file:
            match line.split():
                case ["$scope", _, name, "$end"]:
                    scope.append(name)
                case ["$upscope", "$end"]:
                    scope.pop()
                case ["$var", kind, bits, _, name, "$end"]:
                    found.append(
                        Variable(tuple(scope), name, 0 if kind == "string" else int(bits)))
                case ["$enddefinitions", *_]:
                    break
    return found


@contextmanager
def staged(vcd: Path) -> Iterator[tuple[Path, Path]]:
    """Yield temporary paths for a VCD and its save file; move both to their places at the end.

    If the body fails, existing files stay.

    Raises
    ------
    OSError
        If they cannot be written there.
    """
    if vcd.suffix == ".gtkw":
        raise OSError(0, "the save file takes this name, let it end in .vcd", str(vcd))
    names = [vcd, vcd.with_suffix(".gtkw")]
    for name in names:
        if name.exists() and not name.is_file():
            raise OSError(0, "it is not a file", str(name))
    places = [Path(os.path.realpath(name)) for name in names]
    token = secrets.token_hex(6)
    parts = [place.parent / f".{token}{place.suffix}" for place in places]
    try:
        for part, name in zip(parts, names, strict=True):
            try:
                part.touch(exist_ok=False)
            except OSError as error:
                error.filename = str(name)
                raise
        yield parts[0], parts[1]
        for part, place in zip(parts, places, strict=True):
            os.replace(part, place)
    finally:
        for part in parts:
            with suppress(OSError):
                part.unlink()


def save_file(
    save: Path, vcd: Path, layout: Layout, *, home: Path, clocks: int, mark: int | None = None,
) -> None:
    """Write a save file for GTKWave: clock and reset, inputs, states, what is inside, outputs.

    Parameters
    ----------
    save, vcd : Path
        The file to write; the waveform that it belongs to.
    layout : Layout
        Signals to show.
    home : Path
        Final path of the waveform.
    clocks : int
        Its length, which fills the window.
    mark : int, optional
        Clock of the marker.
    """
    declared = variables(vcd)
    known = {".".join((*var.scope, var.name)): var for var in declared}

    def port(name: str) -> list[tuple[str, Variable]]:
        """Return the variables of a port, or of its fields."""
        fields = [var for var in declared
                  if ".".join(var.scope) == TOP and var.name.startswith(f"\\{name}.")]
        return [(var.name.lstrip("\\").replace("_payload", "").replace(".", "_"), var)
                for var in fields or [known[f"{TOP}.{name}"]]]

    highest = sorted(declared, key=lambda var: len(var.scope))
    clocking = [next(var for var in highest if var.name == name) for name in ("clk", "rst")]
    groups = {
        "clock and reset": [(var.name, var) for var in clocking],
        "inputs": [row for name in layout.inputs for row in port(name)],
        "states": [(var.name.removesuffix("_state"), var) for var in declared
                   if var.bits == 0 and var.name.endswith("_state")],
        "inside": [("_".join(path.split(".")[-2:]), known[f"{TOP}.{layout.design}.{path}"])
                   for path in layout.inside],
        "outputs": [row for name in layout.outputs for row in port(name)],
    }
    with save.open("w", encoding="utf-8") as file:
        gtkw = GTKWSave(file)
        gtkw.dumpfile(str(home))
        gtkw.savefile(str(home.with_suffix(".gtkw")))
        gtkw.size(*WINDOW)
        gtkw.sst_expanded(False)
        gtkw.signals_width(NAMES)
        shown = max(1, clocks) * PERIOD * FEMTO / (WINDOW[0] - NAMES - REST)
        gtkw.zoom_markers(-log2(shown * FRAME),
                          -1 if mark is None else max(0, mark * PERIOD - PERIOD // 2) * FEMTO)
        for title, rows in groups.items():
            if rows:
                with gtkw.group(title):
                    for alias, var in rows:
                        _trace(gtkw, alias, var)


def _trace(gtkw: GTKWSave, alias: str, var: Variable) -> None:
    name = var.name.split(".")[-1]
    if var.bits == 0:
        gtkw.trace(var.path, alias, datafmt="ascii", color=GTKWColor.orange)
    elif var.bits == 1 or name in BITS:
        gtkw.trace(var.path, alias, datafmt="bin")
    elif ".".join((var.scope[-1], name)) in GRAPHS:
        gtkw.trace(var.path, alias, datafmt="signed", extraflags=GTKWFlag.analog_step)
        gtkw.blank(analog_extend=True)
    else:
        datafmt = "hex" if name in HEX else "signed" if name in SIGNED else "dec"
        gtkw.trace(var.path, alias, datafmt=datafmt)
