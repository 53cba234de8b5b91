"""Formulas of arcs and helices, in any plane: what a line needs, and what the rotator does.

Coordinates are u, v and w: of the axes of the plane u is that with more steps per metre (the first
one if they are equal), v the other, w goes across. Where that takes the second axis of the plane
before the first, the arc is seen from behind, and clockwise becomes counter-clockwise.

Angles are in 2**-36 of a full turn, which they wrap at, but ``sweep`` in 2**-33 rad.
"""

from collections.abc import Iterator, Sequence
from math import pi

from .formulas import Formulas, FormulaTable, Registers
from .line import (
    AXES,
    WIDTH,
    Line,
    Rows,
    acceleration_rows,
    distance_rows,
    increment_rows,
    junction_rows,
    least,
    line_registers,
    magnitude,
    nominal_rows,
    speed_rows,
    tick_rows,
    vector,
)
from .line import TABLES as LINE_TABLES

__all__ = ["arc_formulas", "arc_registers"]

MAX_EXPONENT = 21
"""Of the unit of the rotator, 2 to this many steps."""
MAX_RADIUS = 1 << 33
"""In nm; radii are smaller."""
PLANES = ("xyz", "zxy", "yzx")
"""First and second axis of each plane, and the one across."""
TERMS = [round(4 / (2 * pi) * (1 << WIDTH) / (2 * n + 1)) for n in range(7)]
"""Of 4 atan(t) / t, in 2**-36 turns, by powers of -t²; for t below tan(pi / 16)."""


def arc_registers() -> Registers:
    """Return the registers of lines and arcs, with their constants; lines' have the same numbers.

    Names with a u, v or w are by the axes as an arc takes them, but for ``centre``, which is by the
    plane.
    """
    registers = line_registers(256)
    registers.word("plane", "clockwise", "radius", "verdict", "apart", "channels", "shift", "x",
                   "y", "residual", "swapped", "mirrored", "gap", "sweep", "angle", "angle_end",
                   "lower", "upper", "tangent", "series", "ratio", "ahead", "exchanged")
    # The low words of these stay 0.
    registers.pair("speed_plane", "speed_across", "acceleration_plane", "acceleration_across")
    registers.pair("acceleration_half", "turns")
    most_steps = 10**9 << MAX_EXPONENT + 9
    registers.pair("most_steps", high=most_steps >> WIDTH, low=most_steps % (1 << WIDTH))
    registers.word(*(f"{name}_{axis}" for axis in "uvw" for name in (
        "from", "to", "unit", "unit_end", "place", "steps")))
    registers.word(*(f"{name}_{axis}" for axis in "uv" for name in (
        "centre", "middle", "start", "end", "cosine", "cosine_end", "chord", "speed",
        "acceleration")))
    for name, value in {
            "2": 2, "3": 3, "4": 4, "7": 7, "32": 32, "33": 33, "34": 34, "128": 128, "460": 460,
            "500000": 500_000, "500001": 500_001, "30e6": 30_000_000,
            "1e9<<6": 10**9 << 6, "0.866": int(0.866 * (1 << WIDTH)),
            "2 pi": round(2 * pi * (1 << 33)), "quarter_turn": 1 << WIDTH - 2,
            "half_turn": 1 << WIDTH - 1, "epsilon": int(5e-7 / (2 * pi) * (1 << WIDTH)) + 1,
            "max_radius": MAX_RADIUS, "reach": 2 * MAX_RADIUS + (1 << 30)}.items():
        registers.word(name, init=value)
    for number, value in enumerate(TERMS):
        registers.word(f"term_{number}", init=value)
    for axes in PLANES:
        for order, name in ("uvw", "ahead"), ("vuw", "exchanged"):
            registers.word(f"{axes}_{name}", init=sum(
                "uvw".index(channel) << 2 * AXES.index(axis)
                for axis, channel in zip(axes, order, strict=True)))
    return registers


REGISTERS = arc_registers()
"""Registers of the formulas of lines and arcs, by name."""


def chosen(flag: str, a: str, b: str, *selected: tuple[str, str, str]) -> Rows:
    """Select, with a flag from a - b."""
    yield flag, a, b, "flag"
    for row in selected:
        yield "SELECT", *row


def signed_by(flag: str, a: str, b: str, word: str, to: str) -> Rows:
    """Negate, with a flag from a - b."""
    yield flag, a, b, "flag"
    yield "NEGATE", word, word, to


def by_plane(choices: Sequence[tuple[str, Sequence[str]]]) -> Rows:
    """Select registers: each destination, and what goes there in each plane."""
    yield from chosen("SUBTRACT", "plane", "2", *((zx, yz, to) for to, (_, zx, yz) in choices))
    yield from chosen("SUBTRACT", "plane", "1", *((xy, to, to) for to, (xy, _, _) in choices))


def _exchanged(*names: str) -> Iterator[tuple[str, str, str]]:
    """Exchange those of u and v, where the flag is set."""
    for name in names:
        u, v = f"{name}_u", f"{name}_v"
        yield from ((u, u, "a"), (v, u, u), ("a", v, v))


def _plane() -> Rows:
    """Take the axes of the plane as u, v and w."""
    sources = {"from": "from", "to": "to", "place": "place_before", "steps": "steps",
               "speed": "max_speed", "acceleration": "max_acceleration"}
    across = {"speed_w": "speed_across", "acceleration_w": "acceleration_across"}
    choices = [(across.get(f"{name}_{axis}", f"{name}_{axis}"),
                [f"{source}_{axes['uvw'.index(axis)]}" for axes in PLANES])
               for name, source in sources.items() for axis in "uvw"]
    choices += [(way, [f"{axes}_{way}" for axes in PLANES]) for way in ("ahead", "exchanged")]
    yield from by_plane(choices)
    yield from least("speed_u", "speed_v", "speed_plane")
    yield from least("acceleration_u", "acceleration_v", "acceleration_plane")
    yield "SUBTRACT", "1", "clockwise", "a"
    yield from chosen("SUBTRACT", "steps_u", "steps_v",
                       ("1", "zero", "swapped"), ("a", "clockwise", "mirrored"),
                       ("exchanged", "ahead", "channels"),
                       ("centre_v", "centre_u", "middle_u"), ("centre_u", "centre_v", "middle_v"),
                       *_exchanged("from", "to", "place", "steps"))
    yield "ADD", "zero", "zero", "verdict"
    for axis in "uv":
        yield from magnitude(f"to_{axis}", f"from_{axis}", f"chord_{axis}")


def squares(a: str, b: str, to: str) -> Rows:
    yield "MULTIPLY", a, a, to
    yield "MULTIPLY", b, b, "product"
    yield "ADD", f"{to}.low", "product.low", f"{to}.low"
    yield "ADD_CARRY", to, "product", to


def _refused(code: str, *, to: str = "verdict", fits: bool) -> tuple[str, str, str, str]:
    """Set a verdict if the flag is not as it ought to be."""
    return ("SELECT", to, code, to) if fits else ("SELECT", code, to, to)


def _centre() -> Rows:
    """Take the centre of a radius.

    It is half of the chord, and across it half of the root of 4 radius² - chord².
    """
    yield from signed_by("DIFFERENCE", "radius", "zero", "radius", "b")
    yield "SUBTRACT", "b", "max_radius", "flag"
    yield _refused("33", fits=True)
    for axis, name in zip("uv", "xy", strict=True):
        yield from least(f"chord_{axis}", "half_turn", f"distance_{name}")
    yield from squares("distance_x", "distance_y", "part")
    yield "SUBTRACT", "zero", "part.low", "flag"
    yield "SUBTRACT_BORROW", "zero", "part", "flag"
    yield _refused("34", fits=True)
    yield "ADD", "b", "b", "b"
    yield "MULTIPLY", "b", "b", "product"
    yield "SUBTRACT", "product.low", "part.low", "scaled.low"
    yield "SUBTRACT_BORROW", "product", "part", "scaled"
    yield _refused("34", fits=False)
    yield "SHIFT_LEFT", "scaled", "4", "scaled"
    yield "ROOT", "scaled", "zero", "ratio"  # in 1/4 nm
    yield "ADD", "zero", "zero", "distance_z"
    yield from vector()
    for axis, other, name in ("u", "v", "y"), ("v", "u", "x"):
        yield "RATIO", f"component_{name}.low", "length", "a"
        yield "MULTIPLY", "a", "ratio", "product"
        yield "ADD", "product.low", "half_turn", "flag"
        yield "ADD_CARRY", "product", "zero", "a"
        yield from signed_by("DIFFERENCE", f"to_{other}", f"from_{other}", "a", "a")
        yield from signed_by("DIFFERENCE", "radius", "zero", "a", "a")
        yield from signed_by("SUBTRACT", "zero", "mirrored", "a", "a")
        yield "SUBTRACT", f"to_{axis}", f"from_{axis}", "b"
        yield ("SUBTRACT" if axis == "u" else "ADD"), "b", "a", "b"
        yield "ADD", "b", "half_turn", "b"
        yield "ADD", "b", "1", "part"
        yield "SHIFT_RIGHT", "part", "1", "part"
        yield "SUBTRACT", "part", "quarter_turn", f"middle_{axis}"


def _check() -> Rows:
    """Compare the radii of start and end, and refuse what is too large or too small."""
    yield "ADD", "zero", "zero", "a"
    for axis in "uv":
        yield "SUBTRACT", f"chord_{axis}", "reach", "flag"
        yield _refused("33", to="a", fits=True)
        yield "SUBTRACT", "zero", f"middle_{axis}", f"start_{axis}"
        yield from signed_by("DIFFERENCE", f"middle_{axis}", "zero", f"middle_{axis}", "b")
        yield "ADD", "b", "zero", "lower" if axis == "u" else "upper"
        yield "SUBTRACT", "b", "max_radius", "flag"
        yield _refused("33", to="a", fits=True)
    yield from squares("lower", "upper", "part")
    yield "ROOT", "part", "zero", "ratio"
    yield "SUBTRACT", "ratio", "max_radius", "flag"
    yield _refused("33", to="a", fits=True)
    yield "SUBTRACT", "zero", "ratio", "flag"
    yield _refused("33", to="a", fits=True)
    for axis in "uv":
        yield "SUBTRACT", f"to_{axis}", f"from_{axis}", "b"
        yield "SUBTRACT", "b", f"middle_{axis}", f"end_{axis}"
        yield from signed_by("DIFFERENCE", f"end_{axis}", "zero", f"end_{axis}",
                              "lower" if axis == "u" else "upper")
    yield from squares("lower", "upper", "part")
    yield "ROOT", "part", "zero", "b"
    yield "SUBTRACT", "b", "ratio", "gap"
    yield "NEGATE", "gap", "gap", "gap"
    yield "SUBTRACT", "500000", "gap", "flag"
    yield _refused("33", to="a", fits=False)
    yield from least("gap", "500001", "gap")
    yield "MULTIPLY", "gap", "1e3", "product"
    yield "SUBTRACT", "ratio", "product.low", "flag"
    yield "SELECT", "33", "a", "b"
    yield "SUBTRACT", "5000", "gap", "flag"
    yield "SELECT", "b", "a", "a"
    yield "ADD", "ratio", "1", "b"
    yield "MULTIPLY", "b", "steps_u", "product"
    yield "SUBTRACT", "most_steps.low", "product.low", "flag"
    yield "SUBTRACT_BORROW", "most_steps", "product", "flag"
    yield _refused("33", to="a", fits=False)
    yield from chosen("SUBTRACT", "zero", "verdict", ("verdict", "a", "verdict"))


def _direction(name: str, cosine: str) -> Rows:
    """Take the angle of a vector, its cosine and sine without a sign, and its length."""
    for axis, to in zip("uv", "xy", strict=True):
        yield from magnitude(f"{name}_{axis}", "zero", f"distance_{to}")
    yield "ADD", "zero", "zero", "distance_z"
    yield from vector()
    p, q = f"{cosine}_u", f"{cosine}_v"
    yield "RATIO", "component_x.low", "length", p
    yield "RATIO", "component_y.low", "length", q
    yield from chosen("SUBTRACT", p, q, (p, q, "lower"), (q, p, "upper"))
    # Tangents of a half and of a quarter of the angle up to 1/8 turn, of which the latter is in
    # 2**-36.
    yield "ADD", "upper", "half", "a"
    yield "RATIO", "lower", "a", "tangent"
    yield "MULTIPLY", "tangent", "tangent", "product"
    yield "ADD", "product", "one", "product"
    yield "ROOT", "product", "zero", "a"
    yield "ADD", "a", "half", "a"
    yield "ADD", "tangent", "tangent", "tangent"
    yield "ADD", "tangent", "tangent", "tangent"
    yield "RATIO", "tangent", "a", "tangent"
    yield "MULTIPLY", "tangent", "tangent", "product"
    for number in reversed(range(len(TERMS) - 1)):
        yield "MULTIPLY", "product", \
            f"term_{number + 1}" if number == len(TERMS) - 2 else "series", "part"
        yield "SUBTRACT", f"term_{number}", "part", "series"
    yield "MULTIPLY", "tangent", "series", "part"
    # The octant, the half and the sign.
    yield "SUBTRACT", p, q, "flag"
    yield "NEGATE", "part", "part", "angle"
    yield "SELECT", "quarter_turn", "zero", "a"
    yield "ADD", "angle", "a", "angle"
    yield "DIFFERENCE", f"{name}_u", "zero", "flag"
    yield "NEGATE", "angle", "angle", "angle"
    yield "SELECT", "half_turn", "zero", "a"
    yield "ADD", "angle", "a", "angle"
    yield from signed_by("DIFFERENCE", f"{name}_v", "zero", "angle", "angle")


def _sweep() -> Rows:
    """Take the angle from start to end; up to 5e-7 rad are a full turn more."""
    yield from _direction("end", "cosine_end")
    yield "ADD", "angle", "zero", "angle_end"
    yield from _direction("start", "cosine")
    yield "SUBTRACT", "angle_end", "angle", "a"
    yield from signed_by("SUBTRACT", "zero", "mirrored", "a", "a")
    yield from chosen("SUBTRACT", "a", "epsilon", ("2 pi", "zero", "b"))
    yield "MULTIPLY", "a", "2 pi", "part"
    yield "ADD", "part", "b", "sweep"


def _rotator() -> Rows:
    """Take what the rotator does.

    The radius is numerator x 2**(28 - its low word - exponent) in nm steps per metre.
    """
    yield "MULTIPLY", "length", "steps_u", "product"
    yield "NORMALISE", "product", "zero", "numerator"
    yield "RATIO", "numerator", "1e9<<6", "part"
    yield "SUBTRACT", "34", "numerator.low", "shift"
    yield "SUBTRACT", "shift", "exponent", "shift"
    yield from chosen("SUBTRACT", "1e9<<6", "numerator", ("1", "zero", "b"))
    yield "ADD", "shift", "b", "shift"
    yield "SHIFT_RIGHT", "part", "b", "part"
    yield "DIFFERENCE", "shift", "1", "a"
    yield "NEGATE", "a", "a", "a"
    yield "SELECT", "a", "zero", "a"
    yield "SELECT", "1", "shift", "shift"
    yield "SHIFT_RIGHT_LONG", "part", "a", "part"  # radius in 2**-34 of the unit
    for axis, to in zip("uv", "xy", strict=True):
        yield "MULTIPLY", f"cosine_{axis}", "part", "product"
        yield "SHIFT_LEFT", "product", "2", "scaled"
        yield from signed_by("DIFFERENCE", f"start_{axis}", "zero", "scaled", to)
    yield "SUBTRACT", "28", "shift", "a"
    yield "ADD", "shift", "3", "shift"
    yield "SHIFT_RIGHT", "sweep", "a", "part"
    yield "ADD", "part", "1", "part"
    yield "SHIFT_RIGHT", "part", "1", "turns"
    yield "ADD", "place_v", "128", "quotient"
    yield "SHIFT_LEFT", "quotient", "28", "product"
    yield "MULTIPLY", "product", "steps_u", "product"
    yield "SHIFT_RIGHT", "product", "7", "part"
    yield "ADD", "part", "zero", "residual"


def _end() -> Rows:
    """Let the arc end on its circle, if the end is further from it than 0.9 steps."""
    yield "MULTIPLY", "gap", "steps_u", "product"
    yield "DIVIDE", "product", "1e9", "a"
    yield from chosen("SUBTRACT", "a", "460", ("zero", "1", "apart"))
    yield "ADD", "exponent", "32", "b"
    for axis in "uv":
        yield "MULTIPLY", "length", f"cosine_end_{axis}", "product"
        yield "SHIFT_RIGHT_LONG", "product", "b", "product"
        yield "ADD", "product.low", "1", "product.low"
        yield "SHIFT_RIGHT", "product", "1", "product"
        yield from signed_by("DIFFERENCE", f"end_{axis}", "zero", "product.low", "part")
        yield "ADD", "part", f"middle_{axis}", "part"
        yield "ADD", "part", f"from_{axis}", "part"
        yield from chosen("SUBTRACT", "zero", "apart", ("part", f"to_{axis}", f"to_{axis}"))


def _helix() -> Rows:
    """Take half the path, the limits of its speed, and its directions at both ends.

    In the plane the speed is at most that of which 0.866 of the acceleration keeps it on the
    circle, so half of it is left along the path.
    """
    yield "MULTIPLY", "length", "0.866", "product"
    yield "MULTIPLY", "product", "acceleration_plane", "product"
    yield "SUBTRACT", "exponent", "1", "a"
    yield "SHIFT_RIGHT", "product", "a", "product"
    yield "ROOT", "product", "zero", "a"
    yield from least("a", "speed_plane", "speed_plane")
    yield "SHIFT_RIGHT", "acceleration_plane", "1", "acceleration_half"
    yield "MULTIPLY", "length", "sweep", "product"
    yield "SUBTRACT", "exponent", "3", "a"
    yield "SHIFT_RIGHT", "product", "a", "distance_x"
    yield from magnitude("to_w", "from_w", "distance_y")
    yield "SHIFT_RIGHT", "distance_y", "1", "distance_y"
    yield from vector()
    yield "SUBTRACT", "exponent", "1", "exponent"
    yield "RATIO", "component_x.low", "length", "ratio"
    yield "RATIO", "component_y.low", "length", "b"
    for unit, cosine, at in ("unit", "cosine", "start"), ("unit_end", "cosine_end", "end"):
        for axis, other in ("u", "v"), ("v", "u"):
            yield "MULTIPLY", f"{cosine}_{other}", "ratio", "product"
            yield "SHIFT_LEFT", "product", "2", "product"
            yield from signed_by("DIFFERENCE", *(
                ("zero", f"{at}_v") if axis == "u" else (f"{at}_u", "zero")), "product", "a")
            yield from signed_by("SUBTRACT", "zero", "mirrored", "a", f"{unit}_{axis}")
        yield from signed_by("DIFFERENCE", "to_w", "from_w", "b", f"{unit}_w")


def _to_axes() -> Rows:
    """Put the ends and directions to their axes."""
    names = "to", "unit", "unit_end"
    yield from chosen("SUBTRACT", "zero", "swapped", *_exchanged(*names))
    yield from by_plane([(f"{name}_{axis}", [f"{name}_{'uvw'[axes.index(axis)]}"
                                              for axes in PLANES])
                          for name in names for axis in AXES])


def _turn_speed() -> Rows:
    """Let a half turn take 4 clocks at least, so that there are as many ticks."""
    yield "ADD", "exponent", "9", "a"
    yield "SHIFT_RIGHT_LONG", "scaled", "a", "part"
    yield "DIVIDE", "part", "turns", "a"
    yield from least("a", "fastest", "fastest")


def _inverse() -> Rows:
    """Take the feed at which a path takes its time, of motions in 10**-6 a minute.

    The path is ``length`` / 2**(exponent - 1).
    """
    yield "MULTIPLY", "length", "feed", "product"
    yield "SHIFT_RIGHT", "product", "exponent", "product"
    yield "DIVIDE", "product", "30e6", "feed"
    yield "SUBTRACT", "feed", "1", "flag"
    yield "SELECT", "1", "feed", "feed"


def _arc_path() -> Rows:
    for part in (_sweep, _rotator, _end, _helix, _to_axes):
        yield from part()


def _arc_plan() -> Rows:
    yield from speed_rows(("speed_plane", "speed_across"))
    yield from _turn_speed()
    yield from acceleration_rows(("acceleration_half", "acceleration_across"))
    # An arc of less than 1 nm is 1024 ticks at most. Each can add 4 nm²/s² at any acceleration.
    yield "SUBTRACT", "gain.low", "5000", "flag"
    yield from chosen("SUBTRACT_BORROW", "gain", "zero", ("5000", "gain.low", "gain.low"))
    yield from nominal_rows()
    yield from tick_rows()
    yield from increment_rows()
    for axis in "xy":
        yield "ADD", "zero", "zero", f"distance_{axis}.low"
    yield from junction_rows()


TABLES = LINE_TABLES + tuple(
    FormulaTable.of(name, REGISTERS, rows) for name, rows in [
        ("arc_plane", _plane()), ("arc_centre", _centre()), ("arc_check", _check()),
        ("arc_path", _arc_path()), ("arc_plan", _arc_plan()), ("distance", distance_rows()),
        ("inverse", _inverse())])
"""Tables of formulas: those of lines, and those of arcs.

An arc begins with ``arc_plane``, with all of these in their registers:

- ``from_*``, ``place_before_*``, ``unit_before_*``, ``nominal_before``: left by ``accept`` or
  ``begin``;
- ``to_*``: its end in nm; ``feed`` in nm/s;
- ``plane``: 0, 1 or 2, for XY, ZX or YZ; ``clockwise``: 0 or 1;
- ``centre_u``, ``centre_v``: from the start to the centre in nm, signed, by the first and second
  axis of the plane; or ``radius`` in nm, signed: below 0 is that of the longer arc.

Then come ``arc_centre``, only for a radius, and ``arc_check``. Now ``verdict`` is 0 if the arc can
be made; 33 if the radii of start and end differ by over 0.5 mm, or by over 0.005 mm and 0.1 %, or
the radius is 0, 2**33 nm or more, or more than 2**21 steps of an axis of the plane; 34 if a radius
does not reach the end. With 0 ``arc_path`` and ``arc_plan`` compute, of what the three have left,
all that ``line`` does of a line, and

- ``turns``, ``shift``, ``x``, ``y``, ``residual`` as they are in a ``Segment``, whose clockwise is
  ``mirrored``, and whose channels are ``channels``: 2 bits an axis, that of X lowest. Half turns
  count as 2**-(shift + 1) rad; that is off by 0.04 of one at most;
- ``steps_u`` and ``steps_v``: 2**9 x steps per metre of the finer and the coarser axis;
- ``apart``: 1 if the end was 0.9 steps or more off the circle. Then ``to_*`` has been replaced by
  the point of the circle in the same direction, and a line to the end has to follow. Otherwise the
  walk's corrective steps reach it.

Where ``feed`` is motions in 10**-6 a minute, ``inverse`` turns it into nm/s: after ``arc_path``, or
for a line after ``distance``, before ``line``.

``accept`` makes the end the next start. Tables of other things may be run before it, ``report``
among them, but ``line`` only after it.
"""


def arc_formulas(line: Line | None = None) -> Formulas:
    """Return the formulas of lines and arcs, with the settings of a machine."""
    return Formulas(tables=TABLES, init=REGISTERS.image((line or Line()).values()), width=WIDTH)
