"""Formulas of a straight line: what planning, speed profile and walk need to know of it.

Words have 36 bits. Lengths are kept as mantissa and exponent: a vector is shifted until its largest
component has 35 bits, so that directions and ratios are as exact for a nanometre as for 34 m. What
is rounded is rounded down, so limits are never exceeded.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ..checks import in_range
from .formulas import Formulas, FormulaTable, Registers

__all__ = ["Line", "line_formulas"]

WIDTH = 36
AXES = "xyz"
CORNER = 34_000_000_000
"""Positions reach to so many nanometres, either way; a whole number of steps x 2 x 10^9."""
SQUARED = 62
"""Bits of a squared speed."""
MAX_TICKS = 40
"""Highest exponent of the number of ticks."""

Rows = Iterator[tuple[str, str, str, str]]


@dataclass(frozen=True, kw_only=True)
class Line:
    """Settings of a machine, as the registers want them.

    Attributes
    ----------
    clock : int
        Clock in Hz, from 2 000 000 to 2**27 - 1.
    speeds : sequence of int
        Highest speed of each axis in nm/s, from 2 to 2**31 - 1.
    accelerations : sequence of int
        Highest acceleration of each axis in nm/s², from 1 to 2**34 - 1.
    steps : sequence of int
        Steps per metre of each axis, from 1 to 2**27 - 1.
    deviation : int
        Junction deviation in nm, from 1 to 2**28 - 1.

    Raises
    ------
    ValueError
        If one is out of range.
    """

    clock: int = 50_000_000
    speeds: Sequence[int] = (100_000_000,) * 3
    accelerations: Sequence[int] = (500_000_000,) * 3
    steps: Sequence[int] = (80_000,) * 3
    deviation: int = 10_000

    def __post_init__(self) -> None:
        in_range("clock", self.clock, 2_000_000, (1 << 27) - 1)
        in_range("deviation", self.deviation, 1, (1 << 28) - 1)
        for axis in range(len(AXES)):
            in_range(f"speed of {AXES[axis]}", self.speeds[axis], 2, (1 << 31) - 1)
            in_range(f"acceleration of {AXES[axis]}", self.accelerations[axis], 1, (1 << 34) - 1)
            in_range(f"steps of {AXES[axis]}", self.steps[axis], 1, (1 << 27) - 1)

    def values(self) -> dict[str, int]:
        """Return the values of the registers of settings, by name."""
        each = zip(AXES, self.speeds, self.accelerations, self.steps, strict=True)
        return {"clock": self.clock << 8, "deviation": self.deviation << 8} | {
            f"{name}_{axis}": value for axis, speed, acceleration, steps in each
            for name, value in [("max_speed", speed), ("max_acceleration", acceleration),
                                ("steps", steps << 9)]}


def _registers() -> Registers:
    """Return the registers of all formulas, with their constants."""
    registers = Registers()
    for axis in AXES:  # the low words stay 0
        registers.pair(*(f"{name}_{axis}" for name in (
            "max_speed", "max_acceleration", "distance")))
    registers.pair("speed", "length", "quotient")  # likewise
    registers.pair("whole")  # its high word stays 0
    registers.pair(*(f"component_{axis}" for axis in AXES))
    registers.pair("nominal", "modulus", "energy", "gain", "junction", "limit", "nominal_before",
                   "sum", "product", "scaled", "part", "largest", "numerator", "denominator")
    registers.pair("one", high=1 << 68 - WIDTH)
    registers.word(*(f"{name}_{axis}" for axis in AXES for name in (
        "from", "to", "unit", "unit_before", "place", "place_before", "increment", "steps")))
    registers.word("feed", "acceleration", "ticks", "clock", "deviation", "exponent", "a", "b",
                   "flag", "zero")
    for name, value in {"9": 9, "14": 14, "28": 28, "37": WIDTH + 1, "40": MAX_TICKS,
                        "ones": (1 << WIDTH) - 1, "half": 1 << WIDTH - 2,
                        "top": 1 << SQUARED - WIDTH, "below_top": (1 << SQUARED - WIDTH) - 1,
                        "most": (1 << WIDTH - 2) - 1, "corner": CORNER,
                        "1e9": 10**9, "2e9": 2 * 10**9}.items():
        registers.word(name, init=value)
    return registers


def _least(a: str, b: str, to: str) -> Rows:
    yield "SUBTRACT", a, b, "flag"
    yield "SELECT", a, b, to


def _least_pair(a: str, b: str, to: str) -> Rows:
    yield "SUBTRACT", f"{a}.low", f"{b}.low", "flag"
    yield "SUBTRACT_BORROW", a, b, "flag"
    yield "SELECT", f"{a}.low", f"{b}.low", f"{to}.low"
    yield "SELECT", a, b, to


def _saturate(pair: str) -> Rows:
    """Let a pair be 2**62 - 1 at most."""
    yield "SUBTRACT", pair, "top", "flag"
    yield "SELECT", f"{pair}.low", "ones", f"{pair}.low"
    yield "SELECT", pair, "below_top", pair


def _magnitude(a: str, b: str, to: str) -> Rows:
    """Take |a - b|, signed."""
    yield "DIFFERENCE", a, b, to
    yield "NEGATE", to, to, to


def _vector() -> Rows:
    """Normalise the distances, of which none has a sign, and take their length.

    The ``component`` of an axis, a low word, is its distance x 2**(exponent - 1), rounded down; the
    largest of them has 35 bits. ``sum`` is that of their squares, and ``length`` its root. If all
    distances are 0, so are these, and the exponent is 37.
    """
    yield "SUBTRACT", "distance_x", "distance_y", "flag"
    yield "SELECT", "distance_y", "distance_x", "largest"
    yield "SUBTRACT", "largest", "distance_z", "flag"
    yield "SELECT", "distance_z", "largest", "largest"
    yield "NORMALISE", "largest", "zero", "numerator"
    yield "ADD", "numerator.low", "zero", "exponent"
    yield "SUBTRACT", "37", "exponent", "a"
    for axis in AXES:
        yield "SHIFT_RIGHT", f"distance_{axis}", "a", f"component_{axis}"
    for axis in AXES:
        component = f"component_{axis}.low"
        yield "MULTIPLY", component, component, "sum" if axis == "x" else "product"
        if axis != "x":
            yield "ADD", "sum.low", "product.low", "sum.low"
            yield "ADD_CARRY", "sum", "product", "sum"
    yield "ROOT", "sum", "zero", "length"


def _least_ratio(limit: str, to: str) -> Rows:
    """Take the least of limit x 2**36 / component of the axes."""
    for axis in AXES:
        yield "DIVIDE", f"{limit}_{axis}", f"component_{axis}.low", to if axis == "x" else "a"
        if axis != "x":
            yield from _least("a", to, to)


def _path() -> Rows:
    for axis in AXES:
        yield from _magnitude(f"to_{axis}", f"from_{axis}", f"distance_{axis}")
    yield from _vector()
    for axis in AXES:
        yield "RATIO", f"component_{axis}.low", "length", "a"
        yield "DIFFERENCE", f"to_{axis}", f"from_{axis}", "flag"
        yield "NEGATE", "a", "a", f"unit_{axis}"


def _speed() -> Rows:
    """Take the top speed: by feed, axes and clock.

    Length x clock is ``scaled`` / 2**(exponent + 7).
    """
    yield from _least_ratio("max_speed", "speed")
    yield "MULTIPLY", "speed", "length", "product"
    yield from _least("product", "feed", "speed")
    yield "MULTIPLY", "length", "clock", "scaled"
    yield "ADD", "exponent", "14", "a"
    yield "SHIFT_RIGHT_LONG", "scaled", "a", "product"
    yield "SUBTRACT", "zero", "product", "flag"
    yield "SELECT", "ones", "product.low", "a"
    yield from _least("a", "speed", "speed")
    yield "MULTIPLY", "speed", "speed", "nominal"


def _acceleration() -> Rows:
    """Take the acceleration, and 2 x it x the length of the path."""
    yield from _least_ratio("max_acceleration", "acceleration")
    yield "MULTIPLY", "acceleration", "length", "product"
    yield from _least("product", "most", "acceleration")
    yield "ADD", "acceleration", "acceleration", "a"
    yield "ADD", "a", "a", "a"
    yield "MULTIPLY", "a", "length", "product"
    yield "SHIFT_RIGHT", "product", "exponent", "gain"
    yield from _saturate("gain")


def _ticks() -> Rows:
    """Split the path into 2**ticks: from the mantissas of length x clock and speed."""
    yield "NORMALISE", "scaled", "zero", "numerator"
    yield "NORMALISE", "speed", "zero", "denominator"
    yield "ADD", "denominator.low", "28", "ticks"
    yield "SUBTRACT", "ticks", "numerator.low", "ticks"
    yield "SUBTRACT", "ticks", "exponent", "ticks"
    yield "SUBTRACT", "numerator", "denominator", "flag"
    yield "SUBTRACT_BORROW", "ticks", "zero", "ticks"
    yield from _least("ticks", "40", "ticks")
    yield "ADD", "ticks", "exponent", "a"
    yield "SUBTRACT", "a", "9", "a"
    yield "SHIFT_RIGHT_LONG", "scaled", "a", "modulus"
    yield "SHIFT_RIGHT", "gain", "ticks", "energy"
    yield "SHIFT_LEFT", "energy", "ticks", "gain"


def _increments() -> Rows:
    """Take the end in 2**-8 step, and how far it is from the start; modulo 2**36.

    Counted from the corner, of which all axes are a multiple of 2e9 away, nothing is negative.
    """
    for axis in AXES:
        yield "ADD", f"to_{axis}", "corner", "a"
        yield "MULTIPLY", "a", f"steps_{axis}", "product"
        yield "ADD", "product.low", "1e9", "b"
        yield "ADD_CARRY", "product", "zero", "whole.low"
        yield "REMAINDER", "whole", "2e9", "part"
        yield "ADD", "b", "zero", "part.low"
        yield "DIVIDE", "part", "2e9", f"place_{axis}"
        yield "SUBTRACT", f"place_{axis}", f"place_before_{axis}", f"increment_{axis}"


def _junction() -> Rows:
    """Take the squared speed of the junction with the line before, and the limit at the entry.

    With d = unit - unit before, c = |d| and s = sqrt(1 - c²/4): 4 deviation s (1 + s) / c times the
    least acceleration / |d| of an axis. ``half`` is 1 in 2**-34.
    """
    for axis in AXES:
        yield from _magnitude(f"unit_{axis}", f"unit_before_{axis}", f"distance_{axis}")
    yield from _vector()
    yield "ADD", "exponent", "exponent", "exponent"
    yield "SHIFT_RIGHT_LONG", "sum", "exponent", "product"  # c²/4 in 2**-68
    yield "SUBTRACT", "one.low", "product.low", "product.low"
    yield "SUBTRACT_BORROW", "one", "product", "product"
    yield "SELECT", "zero", "product.low", "product.low"
    yield "SELECT", "zero", "product", "product"
    yield "ROOT", "product", "zero", "a"  # s
    yield "ADD", "a", "half", "b"
    yield "ADD", "a", "a", "a"
    yield "MULTIPLY", "a", "b", "part"  # s (1 + s), the high word in 2**-33
    yield from _least_ratio("max_acceleration", "b")
    yield "MULTIPLY", "b", "deviation", "product"
    yield "NORMALISE", "product", "zero", "numerator"
    yield "NORMALISE", "length", "zero", "denominator"
    yield "MULTIPLY", "numerator", "part", "product"
    yield "DIVIDE", "product", "denominator", "quotient"
    yield "ADD", "numerator.low", "9", "a"
    yield "ADD", "denominator.low", "exponent", "b"
    yield "SUBTRACT", "a", "b", "a"  # below 0 the speed has more than 62 bits
    yield "SHIFT_RIGHT_LONG", "quotient", "a", "junction"
    yield "SELECT", "ones", "junction", "junction"
    yield from _saturate("junction")
    yield from _least_pair("junction", "nominal", "limit")
    yield from _least_pair("limit", "nominal_before", "limit")


def _line() -> Rows:
    for part in (_path, _speed, _acceleration, _ticks, _increments, _junction):
        yield from part()


def _accept() -> Rows:
    """Let the end be the next start."""
    for axis in AXES:
        for name, to in ("to", "from"), ("unit", "unit_before"), ("place", "place_before"):
            yield "ADD", f"{name}_{axis}", "zero", f"{to}_{axis}"
    for word in "", ".low":
        yield "ADD", f"nominal{word}", "zero", f"nominal_before{word}"


REGISTERS = _registers()
"""Registers of the formulas, by name."""

TABLES = (FormulaTable.of("line", REGISTERS, _line()),
          FormulaTable.of("accept", REGISTERS, _accept()))
"""Tables of formulas: what a line needs, and what makes its end the next start."""


def line_formulas(line: Line | None = None) -> Formulas:
    """Return the formulas of lines, with the settings of a machine."""
    return Formulas(tables=TABLES, init=REGISTERS.image((line or Line()).values()), width=WIDTH)
