"""Formulas of a straight line: what planning, speed profile and walk need to know of it.

Words have 36 bits. Lengths are kept as mantissa and exponent: a vector is shifted until its largest
component has 35 bits, so that directions and ratios are as exact for a nanometre as for 34 m. What
is rounded is rounded down, so limits are never exceeded.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ..checks import in_range
from .formulas import Formulas, FormulaTable, Registers

__all__ = ["Line", "line_formulas"]

WIDTH = 36
LEAST_CLOCK = 2_000_000
"""Lowest clock in Hz."""
AXES = "xyz"
CORNER = 34_000_000_000
"""Positions reach to so many nanometres, either way; a whole number of steps x 2 x 10^9."""
SQUARED = 62
"""Bits of a squared speed."""
OVERRIDE_SHIFT = 28
"""A percentage has so many bits of 0 behind it, where it is a factor of a hundredth in 2**-8."""
MAX_TICKS = 36
"""Highest exponent of the number of ticks."""

MAX_SPEEDS, MAX_ACCELERATIONS = (
    tuple(f"max_{name}_{axis}" for axis in AXES) for name in ("speed", "acceleration"))

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
        Highest acceleration of each axis in nm/s², from 1000 to 2**34 - 1.
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
        in_range("clock", self.clock, LEAST_CLOCK, (1 << 27) - 1)
        in_range("deviation", self.deviation, 1, (1 << 28) - 1)
        for axis in range(len(AXES)):
            in_range(f"speed of {AXES[axis]}", self.speeds[axis], 2, (1 << 31) - 1)
            in_range(f"acceleration of {AXES[axis]}", self.accelerations[axis], 1000,
                     (1 << 34) - 1)
            in_range(f"steps of {AXES[axis]}", self.steps[axis], 1, (1 << 27) - 1)

    def values(self) -> dict[str, int]:
        """Return the values of the registers of settings, by name."""
        each = zip(AXES, self.speeds, self.accelerations, self.steps, strict=True)
        return {"clock": self.clock << 8, "deviation": self.deviation << 8} | {
            f"{name}_{axis}": value for axis, speed, acceleration, steps in each
            for name, value in [("max_speed", speed), ("max_acceleration", acceleration),
                                ("steps", steps << 9)]}


def line_registers(depth: int) -> Registers:
    """Return so many registers, those of lines with their constants among them."""
    registers = Registers(depth)
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
        "from", "to", "unit", "unit_end", "unit_before", "place", "place_before", "increment",
        "steps", "steps_now", "position", "origin")))
    registers.word("path", "speed_now", "spindle", "feed", "fastest", "hundredth",
                   "acceleration", "ticks", "clock", "deviation", "exponent", "a", "b", "flag",
                   "zero")
    registers.another("unit", "path")
    registers.another("unit_of_speed", "fastest")
    registers.word("override", init=100 << OVERRIDE_SHIFT)
    for name, value in {"1": 1, "60": 60, "1e3": 1000, "1e6": 10**6,
                        "1e9": 10**9, "5000": 5_000, "9": 9, "14": 14, "28": 28,
                        "37": WIDTH + 1, "36": MAX_TICKS,
                        "ones": (1 << WIDTH) - 1, "half": 1 << WIDTH - 2,
                        "0.64": (16 << WIDTH) // 25,
                        "top": 1 << SQUARED - WIDTH, "top_speed": (1 << SQUARED // 2) - 1,
                        "most": (1 << WIDTH - 2) - 1, "corner": CORNER,
                        "2e9": 2 * 10**9}.items():
        registers.word(name, init=value)
    return registers


def least(a: str, b: str, to: str) -> Rows:
    yield "SUBTRACT", a, b, "flag"
    yield "SELECT", a, b, to


def _least_pair(a: str, b: str, to: str) -> Rows:
    yield "SUBTRACT", f"{a}.low", f"{b}.low", "flag"
    yield "SUBTRACT_BORROW", a, b, "flag"
    yield "SELECT", f"{a}.low", f"{b}.low", f"{to}.low"
    yield "SELECT", a, b, to


def _saturate(pair: str) -> Rows:
    """Let a pair be 2**62 - 1 at most."""
    yield "SUBTRACT", "top", "1", "a"
    yield "SUBTRACT", pair, "top", "flag"
    yield "SELECT", f"{pair}.low", "ones", f"{pair}.low"
    yield "SELECT", pair, "a", pair


def magnitude(a: str, b: str, to: str) -> Rows:
    """Take |a - b|, signed."""
    yield "DIFFERENCE", a, b, to
    yield "NEGATE", to, to, to


def vector() -> Rows:
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


def _least_ratio(limits: Iterable[str], to: str) -> Rows:
    """Take the least of limit x 2**36 / component of the axes."""
    for axis, limit in zip(AXES, limits, strict=False):
        yield "DIVIDE", limit, f"component_{axis}.low", to if axis == "x" else "a"
        if axis != "x":
            yield from least("a", to, to)


def distance_rows() -> Rows:
    """Take the length of a line."""
    for axis in AXES:
        yield from magnitude(f"to_{axis}", f"from_{axis}", f"distance_{axis}")
    yield from vector()


def _path() -> Rows:
    yield from distance_rows()
    yield "ADD", "largest", "zero", "path"
    for axis in AXES:
        yield "RATIO", f"component_{axis}.low", "length", "a"
        yield "DIFFERENCE", f"to_{axis}", f"from_{axis}", "flag"
        for name in "unit", "unit_end":
            yield "NEGATE", "a", "a", f"{name}_{axis}"


def speed_rows(limits: Iterable[str]) -> Rows:
    """Take the speed that is never exceeded: by limits of the components, clock, and profile.

    Length x clock is ``scaled`` / 2**(exponent + 7).
    """
    yield from _least_ratio(limits, "fastest")
    yield "MULTIPLY", "fastest", "length", "product"
    yield "ADD", "product", "zero", "fastest"
    yield "MULTIPLY", "length", "clock", "scaled"
    yield "ADD", "exponent", "14", "a"
    yield "SHIFT_RIGHT_LONG", "scaled", "a", "product"
    yield "SUBTRACT", "zero", "product", "flag"
    yield "SELECT", "ones", "product.low", "a"
    yield from least("a", "fastest", "fastest")
    yield from least("top_speed", "fastest", "fastest")


def acceleration_rows(limits: Iterable[str]) -> Rows:
    """Take the acceleration, and 2 x it x the length of the path."""
    yield from _least_ratio(limits, "acceleration")
    yield "MULTIPLY", "acceleration", "length", "product"
    yield from least("product", "most", "acceleration")
    yield "ADD", "acceleration", "acceleration", "a"
    yield "ADD", "a", "a", "a"
    yield "MULTIPLY", "a", "length", "product"
    yield "SHIFT_RIGHT", "product", "exponent", "gain"


def nominal_rows() -> Rows:
    """Take a hundredth of the feed in 2**-8 nm/s, rounded up, and the speed by it.

    So 100 of them are the feed itself, and 256 more than any override makes of it: that is the
    ``speed`` for which ticks are made, if it is not too fast. A feed above 17 m/s is the fastest
    speed; the least is 10 nm/s.
    """
    yield "SUBTRACT", "most", "feed", "flag"
    yield "SELECT", "fastest", "feed", "a"
    yield "ADD", "a", "a", "a"
    yield "ADD", "a", "a", "a"
    yield "MULTIPLY", "a", "0.64", "product"
    yield "ADD", "product", "1", "hundredth"
    yield "SUBTRACT", "hundredth", "28", "flag"
    yield "SELECT", "28", "hundredth", "hundredth"
    yield "MULTIPLY", "hundredth", "override", "product"
    yield from least("product", "fastest", "a")
    yield "MULTIPLY", "a", "a", "nominal"
    yield from least("hundredth", "fastest", "speed")


def tick_rows() -> Rows:
    """Split the path into 2**ticks: from the mantissas of length x clock and speed.

    Those of a slow line are 2**-11 to 2**-9 nm, or, where an axis goes further than 2**26 nm, as
    there are 2**36 at most, up to 1.8 nm. Below 5 um/s² they are 16 times as long: with the least
    acceleration, 1 um/s², such a tick still adds 7 nm²/s² to the squared speed, and with no such
    limit the speed would stay 0. Ticks are shorter than the shortest step, and those of 2**-5 nm
    are shorter than two half turns of the smallest arc.
    """
    yield "NORMALISE", "scaled", "zero", "numerator"
    yield "NORMALISE", "speed", "zero", "denominator"
    yield "ADD", "denominator.low", "28", "ticks"
    yield "SUBTRACT", "ticks", "numerator.low", "ticks"
    yield "SUBTRACT", "numerator", "denominator", "flag"
    yield "SUBTRACT_BORROW", "ticks", "zero", "ticks"
    # What `ticks` and `exponent` are together at most: 42 for 2**-7 nm, 46 for 2**-11 nm.
    yield "ADD", "14", "28", "a"
    yield "ADD", "9", "37", "b"
    yield "SUBTRACT", "acceleration", "5000", "flag"
    yield "SELECT", "a", "b", "a"
    yield from least("ticks", "a", "ticks")
    yield "SUBTRACT", "ticks", "exponent", "ticks"
    yield from least("ticks", "36", "ticks")
    yield "ADD", "ticks", "exponent", "a"
    yield "SUBTRACT", "a", "9", "a"
    yield "SHIFT_RIGHT_LONG", "scaled", "a", "modulus"
    yield "SHIFT_RIGHT", "gain", "ticks", "energy"
    yield "SHIFT_LEFT", "energy", "ticks", "gain"


def _places() -> Rows:
    """Take the end in 2**-8 step, rounded down, and modulo 2**36.

    Half a step more, rounded down, is the nearest step. Counted from the corner, of which all axes
    are a multiple of 2e9 away, nothing is negative.
    """
    for axis in AXES:
        yield "ADD", f"to_{axis}", "corner", "a"
        yield "MULTIPLY", "a", f"steps_{axis}", "product"
        yield "ADD", "product", "zero", "whole.low"
        yield "REMAINDER", "whole", "2e9", "part"
        yield "ADD", "product.low", "zero", "part.low"
        yield "DIVIDE", "part", "2e9", f"place_{axis}"


def increment_rows() -> Rows:
    yield from _places()
    for axis in AXES:
        yield "SUBTRACT", f"place_{axis}", f"place_before_{axis}", f"increment_{axis}"


def junction_rows() -> Rows:
    """Take the squared speed of the junction with the line before, and the limit at the entry.

    With d = unit - unit before, c = |d| and s = sqrt(1 - c²/4): 4 deviation s (1 + s) / c times the
    least acceleration / |d| of an axis. ``half`` is 1 in 2**-34.
    """
    for axis in AXES:
        yield from magnitude(f"unit_{axis}", f"unit_before_{axis}", f"distance_{axis}")
    yield from vector()
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
    yield from _least_ratio(MAX_ACCELERATIONS, "b")
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
    yield from _path()
    yield from speed_rows(MAX_SPEEDS)
    yield from acceleration_rows(MAX_ACCELERATIONS)
    for part in (nominal_rows, tick_rows, increment_rows, junction_rows):
        yield from part()


def _accept() -> Rows:
    """Let the end be the next start."""
    for axis in AXES:
        for name, to in ("to", "from"), ("unit_end", "unit_before"), ("place", "place_before"):
            yield "ADD", f"{name}_{axis}", "zero", f"{to}_{axis}"
    for word in "", ".low":
        yield "ADD", f"nominal{word}", "zero", f"nominal_before{word}"


def nearest(sign: str, divisor: str, to: str, *, without: str = "zero") -> Rows:
    """Take ``product`` / `divisor`, to the nearest, with the sign of another, or a difference."""
    yield "SHIFT_RIGHT", divisor, "1", "part"
    yield "ADD", "product.low", "part", "product.low"
    yield "ADD_CARRY", "product", "zero", "product"
    yield "DIVIDE", "product", divisor, "b"
    yield "DIFFERENCE", sign, without, "flag"
    yield "NEGATE", "b", "b", to


def _report() -> Rows:
    """Take the positions of the axes in nm, the speed in mm/min, and that of the spindle in rpm.

    The ``unit``, of so many nm, is a um or a ten thousandth of an inch, with which the speed is in
    tenths of an inch.
    """
    for axis in AXES:
        steps = f"steps_now_{axis}"
        yield from magnitude(steps, "zero", "a")
        yield "MULTIPLY", "a", "1e9", "product"
        yield "SHIFT_LEFT", "product", "9", "product"
        yield from nearest(steps, f"steps_{axis}", f"position_{axis}")
    yield "MULTIPLY", "unit", "1e3", "product"
    yield "ADD", "product.low", "zero", "unit_of_speed"
    for name, factor, unit in ("speed_now", "60", "unit_of_speed"), ("spindle", "1", "1e6"):
        yield "MULTIPLY", name, factor, "product"
        yield from nearest("zero", unit, name)


def _work() -> Rows:
    """Have positions counted from the origin of the work coordinates."""
    for axis in AXES:
        yield "ADD", f"origin_{axis}", "zero", f"to_{axis}"


def _round() -> Rows:
    """Take the positions, counted from ``to_*``, in units."""
    for axis in AXES:
        position, origin = f"position_{axis}", f"to_{axis}"
        yield from magnitude(position, origin, "a")
        yield "MULTIPLY", "a", "1", "product"
        yield from nearest(position, "unit", position, without=origin)


def _begin() -> Rows:
    """Let the position that was reported be the start of the next line, which begins at rest."""
    for axis in AXES:
        yield "ADD", f"position_{axis}", "zero", f"to_{axis}"
    yield from _places()
    for axis in AXES:
        for name, to in ("to", "from"), ("zero", "unit_before"), ("place", "place_before"):
            yield "ADD", name if name == "zero" else f"{name}_{axis}", "zero", f"{to}_{axis}"
    for word in "", ".low":
        yield "ADD", "zero", "zero", f"nominal_before{word}"


REGISTERS = line_registers(256)
"""Registers of the formulas, by name."""

TABLES = (FormulaTable.of("line", REGISTERS, _line()),
          FormulaTable.of("accept", REGISTERS, _accept()),
          FormulaTable.of("report", REGISTERS, _report()),
          FormulaTable.of("begin", REGISTERS, _begin()),
          FormulaTable.of("round", REGISTERS, _round()),
          FormulaTable.of("work", REGISTERS, _work()))
"""Tables of formulas: what a line needs, what makes its end the next start, where the axes are,
what makes that the next start, positions in units, and that these are those of work."""


def line_formulas(line: Line | None = None) -> Formulas:
    """Return the formulas of lines, with the settings of a machine."""
    return Formulas(tables=TABLES, init=REGISTERS.image((line or Line()).values()), width=WIDTH)
