"""Values as text: binary, hexadecimal, decimal."""

import re
from collections.abc import Sequence

from tb.waves import BITS, GRAPHS, HEX, SIGNED

from ..console import UserError
from . import names
from .reader import Signal, Wave
from .trace import Value

__all__ = ["RADIXES", "Radixes", "is_graph"]

RADIXES = ("bin", "hex", "dec", "signed")

LONG = 64
"""Widths above this many bits default to hexadecimal instead of decimal."""


def is_graph(signal: Signal) -> bool:
    """Return whether a signal is a position that is drawn as a curve."""
    return ".".join(signal.parts[-2:]) in GRAPHS


class Radixes:
    """The radix of each signal.

    As in the waveforms of the benches, flags in a word are binary, what a display shows is
    hexadecimal and positions are signed. Any other number is decimal.

    Parameters
    ----------
    wave : Wave
        The wave.
    requested : sequence of str
        Such as ``count=hex``.

    Raises
    ------
    UserError
        If one of these has no match or no radix.
    """

    def __init__(self, wave: Wave, requested: Sequence[str] = ()) -> None:
        self._requested: dict[str, str] = {}
        for item in requested:
            name, _, radix = item.rpartition("=")
            if not name or radix not in RADIXES:
                raise UserError(f"--radix is written NAME=hex, with one of {', '.join(RADIXES)}, "
                                f"not {item!r}")
            for signal in names.several(wave, [name]):
                self._requested[signal.path] = radix

    def of(self, signal: Signal) -> str:
        """Return the radix of a signal."""
        # Amaranth numbers a second signal of the same name: count$3.
        name = re.sub(r"\$\d+$", "", signal.name)
        default = ("signed" if signal.kind == "signed" or name in SIGNED or is_graph(signal)
                 else "bin" if name in BITS else "hex" if name in HEX or signal.bits > LONG
                 else "dec")
        return self._requested.get(signal.path, default)

    def text(self, signal: Signal, value: Value, *, prefix: bool = True) -> str:
        """Format a value; without `prefix`, binary numbers lack their ``0b``."""
        if isinstance(value, float):
            return f"{value:g}"
        if signal.kind == "event":
            return "event"
        if isinstance(value, str):
            return value or "\"\""
        radix = self.of(signal)
        if signal.bits <= 1 and signal.path not in self._requested:
            return str(value)
        if radix == "bin":
            return f"{'0b' if prefix else ''}{value:0{signal.bits}b}"
        if radix == "hex":
            return f"0x{value:0{(signal.bits + 3) // 4}X}"
        if radix == "signed" and value >> max(signal.bits - 1, 0) & 1:
            value -= 1 << signal.bits
        return str(value)
