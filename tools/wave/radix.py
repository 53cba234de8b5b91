"""Values in words: binary, hexadecimal, decimal."""

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
"""Bits from which a number is no more told as decimal unless asked for."""


def is_graph(signal: Signal) -> bool:
    """Say whether a signal is a position that is drawn as a curve."""
    return ".".join(signal.parts[-2:]) in GRAPHS


class Radixes:
    """How the values of each signal are written.

    Bits that mean something each are binary, what a display shows is hexadecimal, positions are
    signed: as in the waveforms of the benches. All else is decimal.

    Parameters
    ----------
    wave : Wave
        The wave.
    asked : sequence of str
        Such as ``count=hex``.

    Raises
    ------
    UserError
        If one of these names no signal or no radix.
    """

    def __init__(self, wave: Wave, asked: Sequence[str] = ()) -> None:
        self._asked: dict[str, str] = {}
        for item in asked:
            name, _, radix = item.rpartition("=")
            if not name or radix not in RADIXES:
                raise UserError(f"--radix is written NAME=hex, with one of {', '.join(RADIXES)}, "
                                f"not {item!r}")
            for signal in names.several(wave, [name]):
                self._asked[signal.path] = radix

    def of(self, signal: Signal) -> str:
        """Return the radix of a signal."""
        # Amaranth numbers a second signal of the same name: count$3.
        name = re.sub(r"\$\d+$", "", signal.name)
        usual = ("signed" if signal.kind == "signed" or name in SIGNED or is_graph(signal)
                 else "bin" if name in BITS else "hex" if name in HEX or signal.bits > LONG
                 else "dec")
        return self._asked.get(signal.path, usual)

    def text(self, signal: Signal, value: Value, *, prefix: bool = True) -> str:
        """Write a value; without `prefix`, binary numbers do not say that they are."""
        if isinstance(value, float):
            return f"{value:g}"
        if signal.kind == "event":
            return "event"
        if isinstance(value, str):
            return value or "\"\""
        radix = self.of(signal)
        if signal.bits <= 1 and signal.path not in self._asked:
            return str(value)
        if radix == "bin":
            return f"{'0b' if prefix else ''}{value:0{signal.bits}b}"
        if radix == "hex":
            return f"0x{value:0{(signal.bits + 3) // 4}X}"
        if radix == "signed" and value >> max(signal.bits - 1, 0) & 1:
            value -= 1 << signal.bits
        return str(value)
