"""Ports of a design for Verilog tools: plain names, and levels in hexadecimal digits."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from amaranth import Value
from numpy.typing import NDArray

from ..design import Design
from . import source

__all__ = ["Port", "from_digits", "instance", "numbered", "to_digits", "wrapper"]

_DIGITS = np.frombuffer(b"0123456789abcdef", np.uint8)
_LEVELS = np.full(256, 255, np.uint8)
_LEVELS[_DIGITS] = np.arange(16)


@dataclass(frozen=True)
class Port:
    """A port with a name that no tool changes.

    Attributes
    ----------
    plain : str
        The plain name.
    name : str
        Its own name.
    width : int
        Width in bits.
    """

    plain: str
    name: str
    width: int

    @property
    def digits(self) -> int:
        """Its width in hexadecimal digits."""
        return -(-self.width // 4)


def numbered(design: Design) -> tuple[list[Port], list[Port]]:
    """Name the inputs of a design i0, i1 and so on, its outputs o0, o1 and so on."""

    def named(letter: str, signals: Mapping) -> list[Port]:
        return [Port(f"{letter}{n}", name, len(Value.cast(signal)))
                for n, (name, signal) in enumerate(signals.items())]

    return named("i", design.inputs), named("o", design.outputs)


def instance(design: Design) -> str:
    """Write an instance of a design in a module whose ports have the plain names."""
    inputs, outputs = numbered(design)
    joined = "".join(f", .\\{port.name} ({port.plain})" for port in (*inputs, *outputs))
    return f"  {source.top_module(design)} \\{design.name} (.\\clk (clk){joined});\n"


def wrapper(design: Design) -> str:
    """Write a module around a design whose ports have the plain names."""
    inputs, outputs = numbered(design)
    declared = [f"input [{port.width - 1}:0] {port.plain}" for port in inputs]
    declared += [f"output [{port.width - 1}:0] {port.plain}" for port in outputs]
    return (f"module fresa_top({', '.join(['input clk', *declared])});\n"
            f"{instance(design)}endmodule\n")


def to_digits(columns: Iterable[tuple[int, NDArray[np.uint64]]]) -> NDArray[np.uint8]:
    """Format rows in hexadecimal; each column comes with its number of digits."""
    written = []
    for digits, values in columns:
        for place in reversed(range(digits)):
            nibble = values >> np.uint64(4 * place) & np.uint64(15)
            written.append(_DIGITS[nibble.astype(np.intp)])
    return np.stack(written, axis=1)


def from_digits(digits: NDArray[np.uint8]) -> tuple[NDArray[np.uint64], NDArray[np.bool_]]:
    """Parse a column, one row of digits per number; also return the rows with unknown bits."""
    values = np.zeros(len(digits), np.uint64)
    unknown = np.zeros(len(digits), bool)
    for column in digits.T:
        nibble = _LEVELS[column]
        unknown |= nibble == 255
        values = values << np.uint64(4) | nibble.astype(np.uint64)
    return values, unknown
